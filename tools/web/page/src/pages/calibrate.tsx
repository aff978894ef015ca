import type { JSX } from "preact";
export function CalibratePage(): JSX.Element { return <p>calibrate</p>; }
