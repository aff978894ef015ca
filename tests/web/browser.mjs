// Starts Chromium for the page: software WebGL, so that every machine draws the same.

import { chromium, playwright } from "./modules.mjs";

const kArguments = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"];

/** The caller closes it. */
export const startBrowser = () => playwright().chromium.launch({ executablePath: chromium(), args: kArguments });

export const kSizes = [{ width: 1280, height: 800 }, { width: 390, height: 844 }];

export const kPages = ["stage", "cameras", "cameras/cam1", "subjects", "calibrate", "takes", "takes/walk_002", "health", "setup", "monitor"];
