import type { JSX } from "preact";
import { helpShown } from "../state/keys";
import { addressOf, kPages, route } from "../state/route";
import { shownTheme, theme } from "../state/theme";
import { Icon } from "./icons";

export function Side(): JSX.Element {
  const other = shownTheme.value === "dark" ? "light" : "dark";
  return (
    <nav class="side" aria-label="Pages" tabIndex={-1}>
      {kPages.map((page) => (
        <a key={page} href={addressOf(page)} aria-current={route.value.page === page ? "page" : undefined}>
          <Icon name={page} />
          <span>{page[0].toUpperCase() + page.slice(1)}</span>
        </a>
      ))}
      <div class="rest">
        <button class="icon-button" type="button" aria-label={`Colours: ${other}`} title={`Colours: ${other} (D)`} onClick={() => (theme.value = other)}><Icon name="theme" /></button>
        <button class="icon-button" type="button" aria-label="Keyboard" title="Keyboard (?)" onClick={() => (helpShown.value = true)}><Icon name="help" /></button>
      </div>
    </nav>
  );
}
