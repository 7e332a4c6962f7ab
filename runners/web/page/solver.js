// The library in a worker: `fredholm.Solver`, and the texts of the `examples` by their names. Calls wait for each other; what is stopped keeps what it
// has, or ends with nothing.
import examples from "../examples.json";
import worker from "../worker.txt";

// Browsers start no worker from a file beside the page, if that is a file, too: it comes from memory.
const address = URL.createObjectURL(new Blob([worker], { type: "text/javascript" }));
// Set-ups look for a wish to stop now and then; what has not after so many milliseconds is ended.
const PATIENCE = 1500;

const encoder = new TextEncoder();

/** Files by name: texts, or bytes. */
const bytesOf = (files) =>
  Object.fromEntries(
    Object.entries(files).map(([name, content]) => [
      name,
      typeof content === "string" ? encoder.encode(content) : content,
    ]),
  );

class Solver {
  #worker;
  #last = Promise.resolve();
  #running;
  #stops = 0;

  constructor() {
    this.#start();
  }

  #start() {
    this.#worker = new Worker(address);
  }

  /** Calls a function of the library with these inputs and files; null if it was stopped without a result. */
  call(name, inputs, files = {}, progress = () => {}) {
    const before = this.#stops;
    const run = () => (before === this.#stops ? this.#run(name, inputs, files, progress) : null);
    const result = this.#last.then(run);
    this.#last = result.catch(() => {});
    return result;
  }

  #run(name, inputs, files, progress) {
    const goOn = URL.createObjectURL(new Blob(["on"]));
    return new Promise((resolve, reject) => {
      const end = (settle, value) => {
        clearTimeout(this.#running.timer);
        URL.revokeObjectURL(goOn);
        this.#running = undefined;
        settle(value);
      };
      const restart = () => {
        this.#worker.terminate();
        this.#start();
      };
      const abandon = () => {
        restart();
        end(resolve, null);
      };
      this.#running = { goOn, abandon };
      this.#worker.onerror = (event) => {
        restart();
        end(reject, new Error(`the solver did not start: ${event.message ?? "its files are missing"}`));
      };
      this.#worker.onmessage = ({ data }) => {
        if ("walked" in data) return progress(data.walked, data.expected);
        if (data.isDefect) restart();
        if ("error" in data) {
          const message = data.isDefect ? `the solver broke down (${data.error}): there may be too little memory` : data.error;
          return end(reject, new Error(message));
        }
        end(resolve, data.result ?? null);
      };
      this.#worker.postMessage({ name, inputs, files: bytesOf(files), goOn });
    });
  }

  /** Solves the problem file of this name. */
  async solve(name, files, progress) {
    const answer = await this.call("solve", [name], files, progress);
    return answer === null ? null : JSON.parse(answer);
  }

  /** Ends what is running, and what waits for that. */
  stop() {
    this.#stops += 1;
    if (!this.#running) return;
    URL.revokeObjectURL(this.#running.goOn);
    this.#running.timer ??= setTimeout(this.#running.abandon, PATIENCE);
  }
}

globalThis.fredholm = { Solver, examples };
