// Settings of this browser. A browser that keeps nothing works with the defaults.

export function stored(key: string, otherwise: string): string {
  try {
    return localStorage.getItem(`mocap.${key}`) ?? otherwise;
  } catch {
    return otherwise;
  }
}

export function store(key: string, value: string): void {
  try {
    localStorage.setItem(`mocap.${key}`, value);
  } catch {
    // Private windows may refuse; the setting then holds until the page is closed.
  }
}
