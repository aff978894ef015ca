// Slates to record, pasted from a spreadsheet: the first column is the slate, the second the notes.

export interface Shot {
  slate: string;
  notes: string;
}

const kMaxShots = 200;
const kMaxText = 200;

/** One shot for each line with a slate. Columns end with a tab, or with a semicolon or comma if the line has no tab. */
export function readShots(text: string): Shot[] {
  const shots: Shot[] = [];
  for (const line of text.split(/\r?\n/)) {
    const columns = line.split(line.includes("\t") ? "\t" : /[;,]/).map((column) => column.trim().slice(0, kMaxText));
    if (columns[0]) shots.push({ slate: columns[0], notes: columns[1] ?? "" });
  }
  return shots.slice(0, kMaxShots);
}

export const writeShots = (shots: Shot[]): string => shots.map((shot) => `${shot.slate}\t${shot.notes}`).join("\n");
