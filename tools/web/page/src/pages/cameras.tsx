import type { JSX } from "preact";
export function CamerasPage(): JSX.Element { return <p>cameras</p>; }
