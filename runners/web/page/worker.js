// Runs the library beside the page, one call after the other.
import start, * as library from "../module/fredholm_web.js";
import base64 from "../module/fredholm_web_bg.wasm.gz";

const unpacked = async () => {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const bytes = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(bytes, { headers: { "content-type": "application/wasm" } });
};
const started = start({ module_or_path: unpacked() });

// Whether the page has revoked the address that stands for "go on": a worker that computes hears no messages.
const isStopped = (address) => {
  const request = new XMLHttpRequest();
  request.open("GET", address, false);
  try {
    request.send();
    return false;
  } catch {
    return true;
  }
};

onmessage = async ({ data: { name, inputs, files, goOn } }) => {
  // Of a page that is a file nothing is heard: the page ends the worker.
  const hears = !isStopped(goOn);
  const progress = (walked, expected) => {
    postMessage({ walked, expected });
    return hears && isStopped(goOn);
  };
  try {
    await started;
    library.put_files(Object.keys(files), Object.values(files));
    const takesProgress = name === "solve" || name === "field";
    const result = library[name](...inputs, ...(takesProgress ? [progress] : []));
    postMessage({ result });
  } catch (error) {
    postMessage({ error: error.message, isDefect: error instanceof WebAssembly.RuntimeError });
  }
};
