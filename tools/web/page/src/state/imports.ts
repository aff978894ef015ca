// Subjects from C3D files: the server runs `mocapctl subject import` and adds the subject.

import { type ImportReport, readImport } from "../model/import_report";

/** As the server limits it. */
export const kMaxC3d_bytes = 8 * 1024 * 1024;

/** Never rejects. */
export async function importC3d(file: File, name: string, atRest: boolean): Promise<ImportReport> {
  if (file.size > kMaxC3d_bytes) return { good: false, message: `${file.name} has ${(file.size / 1048576).toFixed(1)} MiB, expected at most 8 MiB: cut it to some seconds`, warnings: [], found: null };
  try {
    const reply = await fetch(`/api/v1/subjects/import?name=${encodeURIComponent(name)}&static=${atRest}`, {
      method: "POST", headers: { "Content-Type": "application/octet-stream" }, body: file,
    });
    const text = await reply.text();
    return readImport(reply.headers.get("Content-Type")?.startsWith("application/json") ? JSON.parse(text) : { message: text.trim() }, reply.status);
  } catch (error) {
    return { good: false, message: `the server did not take the file: ${error instanceof Error ? error.message : String(error)}`, warnings: [], found: null };
  }
}
