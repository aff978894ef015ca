// The frame of all pages: header, list of pages, the page itself, and what lies over it.

import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { CalibratePage } from "./pages/calibrate";
import { CamerasPage } from "./pages/cameras";
import { HealthPage } from "./pages/health";
import { MonitorPage } from "./pages/monitor";
import { SetupPage } from "./pages/setup";
import { StagePage } from "./pages/stage";
import { SubjectsPage } from "./pages/subjects";
import { TakesPage } from "./pages/takes";
import { Dialogs } from "./parts/dialogs";
import { Header } from "./parts/header";
import { Side } from "./parts/side";
import { Silence } from "./parts/silence";
import { ToastList } from "./parts/toast_list";
import { type PageName, route } from "./state/route";

const pages: Record<PageName, () => JSX.Element> = {
  stage: StagePage, cameras: CamerasPage, subjects: SubjectsPage, calibrate: CalibratePage, takes: TakesPage, health: HealthPage, setup: SetupPage,
  monitor: MonitorPage,
};

export function App(): JSX.Element {
  const { page } = route.value;
  const Page = pages[page];
  const monitor = page === "monitor";
  const title = page[0].toUpperCase() + page.slice(1);
  useEffect(() => {
    document.title = `${title} – mocapd`;
    document.getElementById("page")!.className = monitor ? "plain" : "";
  }, [page]);
  return (
    <>
      {!monitor && <a class="skip" href={`#/${page}`} onClick={() => document.querySelector("main")?.focus()}>To the content</a>}
      {!monitor && <Header />}
      {!monitor && <Side />}
      <main key={page} tabIndex={-1}>
        <h1 class="sr-only">{title}</h1>
        <Page />
      </main>
      <Silence />
      <Dialogs />
      <ToastList />
    </>
  );
}
