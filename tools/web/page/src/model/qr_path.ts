import qrcode from "qrcode-generator";

/** The dark modules of a QR code as the path of an SVG picture, and its size in modules with the quiet zone of four. */
export function qrPath(text: string): { path: string; size: number } {
  const code = qrcode(0, "M");
  code.addData(text);
  code.make();
  const modules = code.getModuleCount();
  let path = "";
  for (let row = 0; row < modules; row++) for (let column = 0; column < modules; column++) if (code.isDark(row, column)) path += `M${column + 4} ${row + 4}h1v1h-1z`;
  return { path, size: modules + 8 };
}
