// Sizes a canvas to its box in device pixels.

const kMaxRatio = 2;

export interface CanvasSize {
  width: number;
  height: number;
  ratio: number;
}

export function boxSize(canvas: HTMLCanvasElement): CanvasSize {
  return { width: Math.max(1, canvas.clientWidth), height: Math.max(1, canvas.clientHeight), ratio: Math.min(kMaxRatio, window.devicePixelRatio || 1) };
}

/** Returns the drawing context, scaled to CSS pixels and cleared; null without a 2D canvas. */
export function clearedContext(canvas: HTMLCanvasElement): { context: CanvasRenderingContext2D; width: number; height: number } | null {
  const { width, height, ratio } = boxSize(canvas);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  if (!context) return null;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
