import type { Description } from "../../gen/mocap/v1/description_pb";
import { type Event, EventKind } from "../../gen/mocap/v1/event_pb";
import type { Level } from "./health_report";

const kinds: Record<EventKind, { text: string; level: Level }> = {
  [EventKind.UNSPECIFIED]: { text: "event", level: "look" }, [EventKind.SUBJECT_FOUND]: { text: "subject found", level: "good" },
  [EventKind.SUBJECT_LOST]: { text: "subject lost", level: "look" }, [EventKind.DESCRIPTION_CHANGED]: { text: "description changed", level: "good" },
  [EventKind.CAMERA_LOST]: { text: "camera lost", level: "bad" }, [EventKind.CAMERA_BACK]: { text: "camera back", level: "good" },
  [EventKind.TAKE_STARTED]: { text: "take started", level: "good" }, [EventKind.TAKE_ENDED]: { text: "take ended", level: "good" },
  [EventKind.TAKE_FAILED]: { text: "take failed", level: "bad" }, [EventKind.MARK]: { text: "mark", level: "good" },
};

export const eventKind = (event: Event): { text: string; level: Level } => kinds[event.kind] ?? kinds[EventKind.UNSPECIFIED];

/** The subject or camera of the event, and its message. */
export function eventText(event: Event, description: Description | null): string {
  const subject = event.subject === undefined ? undefined : description?.subjects[event.subject]?.name;
  const camera = event.camera === undefined ? undefined : description?.cameras[event.camera]?.name;
  return [subject ?? camera, event.message].filter(Boolean).join(": ");
}
