// One camera file's way in from the browser's machine.
export default {
  template: `
    <label class="drop">
      <input type="file" class="off-screen" aria-label="Camera file" @change="send" />
      <span class="hint">choose a camera file of this computer, or name one below</span>
    </label>`,
  methods: {
    async send(event) {
      const [file] = event.target.files;
      event.target.value = "";
      if (!file) return;
      const answer = await fetch(`cameras?${new URLSearchParams({ name: file.name })}`, { method: "PUT", body: file });
      this.$emit("received", answer.ok ? (await answer.json()).path : "");
    },
  },
};
