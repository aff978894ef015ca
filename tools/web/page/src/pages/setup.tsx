import type { JSX } from "preact";
export function SetupPage(): JSX.Element { return <p>setup</p>; }
