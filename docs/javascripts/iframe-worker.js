// Workers for pages that are opened from the disk: browsers refuse real ones there, and the search is one.
// A script in a frame of its own, spoken to by messages. What needs `importScripts` (other languages than
// English) is not here.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    #frame = document.createElement("iframe")
    #ready

    constructor(url) {
      super()
      this.#frame.hidden = true
      this.#frame.srcdoc = "<!doctype html><body></body>"
      this.#ready = new Promise((resolve) => {
        this.#frame.addEventListener("load", () => {
          const inside = this.#frame.contentWindow
          inside.postMessage = (data) =>
            queueMicrotask(() => this.dispatchEvent(new MessageEvent("message", { data })))
          const script = inside.document.createElement("script")
          script.src = new URL(url, location.href)
          script.onload = () => resolve(inside)
          script.onerror = () => this.dispatchEvent(new Event("error"))
          inside.document.body.append(script)
        }, { once: true })
      })
      document.documentElement.append(this.#frame)
    }

    postMessage(data) {
      this.#ready.then((inside) => inside.dispatchEvent(new inside.MessageEvent("message", { data })))
    }

    terminate() {
      this.#frame.remove()
    }
  }
}
