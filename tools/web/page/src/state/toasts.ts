// Short messages about what an order did. A fault stays until it is closed.

import { signal } from "@preact/signals";

export interface Toast {
  id: number;
  good: boolean;
  text: string;
}

const kMaxToasts = 4;
const kShown_ms = 6000;
let nextId = 1;

export const toasts = signal<Toast[]>([]);

export function closeToast(id: number): void {
  toasts.value = toasts.peek().filter((toast) => toast.id !== id);
}

export function say(text: string, good = true): void {
  const id = nextId++;
  toasts.value = [...toasts.peek(), { id, good, text }].slice(-kMaxToasts);
  if (good) window.setTimeout(() => closeToast(id), kShown_ms);
}
