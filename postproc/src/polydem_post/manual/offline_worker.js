// The search of the manual runs in a worker, which browsers do not start from a folder. Run its script in a hidden
// frame instead, whose messages go both ways.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      this.inside = frame.contentWindow;
      this.waiting = [];
      const page = frame.contentDocument;
      this.inside.postMessage = (data) => this.tell(this, data);
      this.inside.importScripts = (...urls) => urls.forEach((name) => this.load(page, name));
      this.load(page, url).addEventListener("load", () => {
        const waiting = this.waiting;
        this.waiting = null;
        waiting.forEach((data) => this.tell(this.inside, data));
      });
    }

    load(page, url) {
      const script = page.createElement("script");
      script.src = url;
      page.body.append(script);
      return script;
    }

    tell(listener, data) {
      const event = new MessageEvent("message", { data });
      setTimeout(() => {
        listener.dispatchEvent(event);
        if (listener === this && this.onmessage) this.onmessage(event);
      });
    }

    postMessage(data) {
      if (this.waiting) this.waiting.push(data);
      else this.tell(this.inside, data);
    }

    terminate() {
      this.waiting = [];
    }
  };
}
