// One camera file's way in from the browser's machine.
export default {
  template: `
    <label class="drop" :class="{ over }" @dragover.prevent="over = true" @dragleave="over = false" @drop.prevent="drop">
      <input type="file" class="off-screen" aria-label="Camera file" @change="pick" />
      <span class="hint">click to choose a camera file of this computer, drop it here, or name one below</span>
    </label>`,
  data() {
    return { over: false };
  },
  methods: {
    pick(event) {
      const [file] = event.target.files;
      event.target.value = ""; // so that the same one can be chosen again
      this.send(file);
    },
    drop(event) {
      this.over = false;
      this.send(event.dataTransfer.files[0]);
    },
    async send(file) {
      if (!file) return;
      const told = { name: file.name, path: "", wrong: "" };
      try {
        const answer = await fetch(`cameras?${new URLSearchParams({ name: file.name })}`, { method: "PUT", body: file });
        const { path, detail } = await answer.json();
        Object.assign(told, answer.ok ? { path } : { wrong: detail });
      } catch {
        told.wrong = "it cannot be read, or is a folder, or the connection is lost";
      }
      this.$emit("received", told);
    },
  },
};
