// The topics that visible parts of the page want. A topic is subscribed while at least one part wants it.

export class WantedTopics {
  private readonly counts = new Map<string, number>();
  private hidden = false;
  private scheduled = false;

  /** `apply` receives the whole list after each change, at most once a task. */
  constructor(private readonly apply: (topics: string[]) => void) {}

  /** Returns the function that ends the wish. */
  want(topic: string): () => void {
    this.counts.set(topic, (this.counts.get(topic) ?? 0) + 1);
    this.schedule();
    let ended = false;
    return () => {
      if (ended) return;
      ended = true;
      const left = (this.counts.get(topic) ?? 1) - 1;
      if (left > 0) this.counts.set(topic, left);
      else this.counts.delete(topic);
      this.schedule();
    };
  }

  /** A hidden page keeps only what is rare and must not be missed. */
  setHidden(hidden: boolean): void {
    this.hidden = hidden;
    this.schedule();
  }

  topics(): string[] {
    const rare = (topic: string) => topic === "description" || topic === "event";
    return [...this.counts.keys()].filter((topic) => !this.hidden || rare(topic)).sort();
  }

  private schedule(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    queueMicrotask(() => {
      this.scheduled = false;
      this.apply(this.topics());
    });
  }
}
