// The rigs that the daemon keeps, and the way back to one of them.

import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import type { KeptRig } from "../../gen/mocap/v1/control_pb";
import { fixed } from "../model/format";
import { listRigs } from "../state/calibration";
import { mayChange, open } from "../state/live";
import { type Outcome, order } from "../state/orders";
import { OrderButton, OutcomeLine, Panel } from "./small";

export function KeptRigs({ changes, restored }: { changes: number; restored(): void }): JSX.Element | null {
  const [rigs, setRigs] = useState<KeptRig[]>([]);
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  useEffect(() => {
    if (!open.value) return undefined;
    let isNewest = true;
    listRigs().then((all) => isNewest && setRigs(all), () => undefined); // a lost connection: the list is asked for again when it is back
    return () => {
      isNewest = false;
    };
  }, [open.value, changes]);
  const restore = async (name: string) => {
    setOutcome(await order("calibration", { action: "ACTION_RESTORE", name }));
    restored();
  };
  return (
    <Panel title="Earlier rigs">
      <div class="stack">
        {rigs.length === 0 && <p class="soft">None yet. The daemon keeps every rig that it calibrates, and the one before.</p>}
        {rigs.length > 0 && (
          <div class="table-box" tabIndex={0} role="region" aria-label="Earlier rigs">
            <table>
              <thead><tr><th>Made (UTC)</th><th class="number">Cameras</th><th class="number">Residual</th><th>By</th><th>Use</th></tr></thead>
              <tbody>
                {rigs.map((rig) => (
                  <tr key={rig.name} data-selected={rig.inForce}>
                    <th scope="row">{rig.name}</th><td class="number">{rig.cameras}</td><td class="number">{rig.rmsPx > 0 ? fixed(rig.rmsPx, 3, "px") : "–"}</td><td>{rig.solvedBy}</td>
                    <td>{rig.inForce ? "in force" : <OrderButton text="Restore" disabled={!mayChange.value} run={() => restore(rig.name)} />}</td>
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
        )}
        <OutcomeLine outcome={outcome} />
      </div>
    </Panel>
  );
}
