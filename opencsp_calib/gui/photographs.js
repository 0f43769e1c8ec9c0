// The photographs' way in: a file input that is in the page from the start, and a place to drop files or folders.
// They are sent at once, a few at a time, as they are. What is dropped beside the place is taken all the same: a browser
// would leave the page for it.
export default {
  template: `
    <div class="drop" :class="{ over }">
      <input ref="input" type="file" multiple class="off-screen" tabindex="-1" aria-label="Photographs"
        accept="image/*,.tif,.tiff,.pgm,.pnm,.ppm,.bmp,.webp" @change="pick" />
      <slot />
    </div>`,
  data() {
    return { over: false };
  },
  mounted() {
    for (const kind of ["dragover", "dragleave", "drop"]) window.addEventListener(kind, this[kind]);
  },
  unmounted() {
    for (const kind of ["dragover", "dragleave", "drop"]) window.removeEventListener(kind, this[kind]);
  },
  methods: {
    open() {
      this.$refs.input.click();
    },
    pick(event) {
      const files = [...event.target.files];
      event.target.value = ""; // so that the same ones can be selected again
      this.send(files);
    },
    concerned(event) {
      return !event.defaultPrevented && event.dataTransfer.types.includes("Files"); // not over the place for a camera file
    },
    dragover(event) {
      if (!this.concerned(event)) return;
      event.preventDefault();
      this.over = this.$el.checkVisibility();
    },
    dragleave() {
      this.over = false;
    },
    async drop(event) {
      this.over = false;
      if (!this.concerned(event)) return;
      event.preventDefault();
      if (!this.$el.checkVisibility()) return;
      const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry()).filter((entry) => entry);
      this.send((await Promise.all(entries.map((entry) => this.inside(entry)))).flat());
    },
    async inside(entry) {
      if (entry.isFile) return [await new Promise((done, failed) => entry.file(done, failed))];
      const reader = entry.createReader();
      const found = [];
      for (;;) {
        const some = await new Promise((done, failed) => reader.readEntries(done, failed)); // at most 100 a time
        if (!some.length) return found;
        found.push(...(await Promise.all(some.filter((one) => one.isFile).map((one) => this.inside(one)))).flat());
      }
    },
    async send(files) {
      if (!files.length) return;
      const batch = `${Date.now()}-${Math.random()}`;
      this.$emit("begun", { batch, count: files.length });
      const waiting = [...files];
      const lost = [];
      const sender = async () => {
        for (let file = waiting.shift(); file; file = waiting.shift()) {
          const query = new URLSearchParams({ name: file.name, batch, count: files.length });
          try {
            const answer = await fetch(`photographs?${query}`, { method: "PUT", body: file });
            if (!answer.ok) lost.push(file.name);
          } catch {
            lost.push(file.name);
          }
        }
      };
      await Promise.all([sender(), sender(), sender()]);
      this.$emit("ended", { batch, lost });
    },
  },
};
