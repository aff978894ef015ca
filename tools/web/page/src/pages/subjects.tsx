import type { JSX } from "preact";
export function SubjectsPage(): JSX.Element { return <p>subjects</p>; }
