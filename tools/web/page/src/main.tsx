import { render } from "preact";
import { App } from "./app";
import { startKeys } from "./state/keys";
import { startLive } from "./state/live";
import { startPreflight } from "./state/preflight";
import { startRoute } from "./state/route";
import { startStageOptions } from "./state/stage_options";
import { startTheme } from "./state/theme";
import "./style/app.css";

startTheme();
startRoute();
startKeys();
startStageOptions();
startLive();
startPreflight();
render(<App />, document.getElementById("page")!);
