// Search in pages opened from the disk, where browsers start no workers: the script runs in a hidden frame.
if (location.protocol === "file:")
  window.Worker = class {
    constructor(address) {
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      document.body.append(this.frame);
      const inner = this.frame.contentWindow;
      inner.postMessage = (data) => this.onmessage?.({ data });
      this.loaded = new Promise((resolve, reject) => {
        const script = inner.document.createElement("script");
        script.src = new URL(address, location.href);
        script.onload = () => resolve(inner);
        script.onerror = (event) => (this.onerror?.(event), reject(event));
        inner.document.body.append(script);
      });
    }
    postMessage(data) {
      this.loaded.then((inner) => inner.onmessage({ data }));
    }
    terminate() {
      this.frame.remove();
    }
  };
