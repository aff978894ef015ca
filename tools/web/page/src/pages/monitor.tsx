import type { JSX } from "preact";
export function MonitorPage(): JSX.Element { return <p>monitor</p>; }
