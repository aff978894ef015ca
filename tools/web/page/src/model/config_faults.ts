// Faults of a configuration in the daemon's answer: "FILE:LINE:COLUMN: text", one a line.

export interface ConfigFault {
  file: string;
  line: number;
  column: number;
  text: string;
}

const kFault = /^\s*(.+?):(\d+):(\d+): (.+)$/;

/** Lines of another form are left out. */
export function readFaults(message: string): ConfigFault[] {
  const faults: ConfigFault[] = [];
  for (const line of message.split("\n")) {
    const found = kFault.exec(line);
    if (found) faults.push({ file: found[1], line: Number(found[2]), column: Number(found[3]), text: found[4] });
  }
  return faults;
}
