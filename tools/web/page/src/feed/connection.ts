// The WebSocket to the server: connects again by itself, sends subscriptions and requests, and notices a peer that fell silent.

import { type FeedMessage, splitMessage } from "./message";
import { type Answer, type ServerText, readServerText } from "./server_text";

const kFirstRetry_ms = 250;
const kLongestRetry_ms = 4000;
// The server sends its state once a second.
const kSilent_ms = 5000;
const kCatchUp_ms = 1000;
// The server gives the daemon 35 s for each order but the learning of masks (tools/web/api.cpp), and then says that no answer came.
const kAnswer_ms = 40000;

export class RequestError extends Error {
  constructor(readonly code: string, message: string) {
    super(message);
  }
}

export interface ConnectionListener {
  opened(): void;
  /** `reason` is for the operator. */
  closed(reason: string): void;
  message(message: FeedMessage): void;
  text(text: ServerText): void;
}

interface Waiting {
  resolve(result: unknown): void;
  reject(error: RequestError): void;
  timer: number;
}

export class Connection {
  private socket: WebSocket | null = null;
  private topics: string[] = [];
  private retry_ms = kFirstRetry_ms;
  private retryTimer = 0;
  private silenceTimer = 0;
  private nextId = 1;
  private readonly waiting = new Map<number, Waiting>();

  constructor(private readonly url: string, private readonly listener: ConnectionListener) {}

  /** Connects now, also if the next attempt was to come later. */
  connect(): void {
    window.clearTimeout(this.retryTimer);
    if (this.socket) return;
    const socket = new WebSocket(this.url, "mocap.v1");
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.onOpen();
    socket.onmessage = (event) => this.onMessage(event.data);
    socket.onclose = (event) => this.drop(socket, event.reason || "the server closed the connection or is not running");
    this.socket = socket;
    this.expectSound();
  }

  /** Replaces the list of topics; kept over a reconnection. */
  subscribe(topics: string[]): void {
    this.topics = topics;
    this.send({ subscribe: topics });
  }

  /** Acknowledges a snapshot; the server then sends the newest one. */
  drawn(frame: number): void {
    this.send({ drawn: frame });
  }

  /** Rejects with a RequestError. */
  request(method: string, params: unknown, patience_ms = kAnswer_ms): Promise<unknown> {
    if (this.socket?.readyState !== WebSocket.OPEN) {
      return Promise.reject(new RequestError("disconnected", "there is no connection to the server; nothing was sent"));
    }
    const id = this.nextId++;
    return new Promise((resolve, reject) => {
      const timer = window.setTimeout(() => {
        this.waiting.delete(id);
        reject(new RequestError("timeout", `no answer within ${patience_ms / 1000} s; the request may still be executed`));
      }, patience_ms);
      this.waiting.set(id, { resolve, reject, timer });
      this.send({ request: { id, method, params } });
    });
  }

  private send(text: unknown): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(text));
  }

  private onOpen(): void {
    this.retry_ms = kFirstRetry_ms;
    this.listener.opened();
    this.send({ subscribe: this.topics });
  }

  private onMessage(data: unknown): void {
    this.expectSound();
    if (data instanceof ArrayBuffer) {
      const message = splitMessage(data);
      if (message) this.listener.message(message);
      return;
    }
    const text = readServerText(String(data));
    if (text.answer) this.settle(text.answer);
    this.listener.text(text);
  }

  private settle(answer: Answer): void {
    const waiting = this.waiting.get(answer.id);
    if (!waiting) return;
    this.waiting.delete(answer.id);
    window.clearTimeout(waiting.timer);
    if (answer.ok) waiting.resolve(answer.result);
    else waiting.reject(new RequestError(answer.code, answer.message || answer.code || "the request failed"));
  }

  private expectSound(): void {
    window.clearTimeout(this.silenceTimer);
    const socket = this.socket;
    const drop = () => socket && this.drop(socket, `the server sent nothing for ${kSilent_ms / 1000} s`);
    // A page that was busy itself (it draws with the processor) has messages waiting: they are handled before it judges the server.
    this.silenceTimer = window.setTimeout(() => {
      this.silenceTimer = window.setTimeout(drop, kCatchUp_ms);
    }, kSilent_ms);
  }

  private drop(socket: WebSocket, reason: string): void {
    if (socket !== this.socket) return;
    this.socket = null;
    window.clearTimeout(this.silenceTimer);
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    for (const waiting of this.waiting.values()) {
      window.clearTimeout(waiting.timer);
      waiting.reject(new RequestError("disconnected", "the connection ended before the answer; the request may have been executed"));
    }
    this.waiting.clear();
    this.listener.closed(reason);
    this.retryTimer = window.setTimeout(() => this.connect(), this.retry_ms);
    this.retry_ms = Math.min(2 * this.retry_ms, kLongestRetry_ms);
  }
}
