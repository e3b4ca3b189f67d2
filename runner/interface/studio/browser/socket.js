// Questions to the server, and their answers.

class Link {
  /** @param {(hello: { text: string, name: string, is_new: boolean }) => void} heard @param {(reason: string) => void} ended */
  constructor(heard, ended) {
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    this.socket = new WebSocket(address);
    /** @type {Map<number, { answer: (found: any) => void, part?: (said: any) => void }>} */
    this.waiting = new Map();
    this.count = 0;
    this.socket.addEventListener("message", ({ data }) => {
      const said = JSON.parse(data);
      if (said.hello) return heard(said.hello);
      const question = this.waiting.get(said.id);
      if (!question) return;
      if (!said.done) return question.part?.(said);
      this.waiting.delete(said.id);
      question.answer(said);
    });
    this.socket.addEventListener("close", ({ reason }) => {
      for (const { answer } of this.waiting.values()) answer({ error: "the studio has ended" });
      this.waiting.clear();
      ended(reason || "the studio has ended");
    });
  }

  /**
   * The answer to a question about a text; `part` takes what comes before it.
   * @param {Question} question @param {(said: any) => void} [part] @returns {Promise<any>}
   */
  ask(question, part) {
    if (this.socket.readyState !== WebSocket.OPEN) return Promise.resolve({ error: "the studio has ended" });
    return new Promise((answer) => {
      this.count++;
      this.waiting.set(this.count, { answer, part });
      this.socket.send(JSON.stringify({ ...question, id: this.count }));
    });
  }
}
