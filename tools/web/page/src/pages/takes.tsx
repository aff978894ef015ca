import type { JSX } from "preact";
export function TakesPage(): JSX.Element { return <p>takes</p>; }
