// One photograph with what was found in it: wheel or + and - to zoom, drag to pan, 0 to see all of it again.
export default {
  template: `
    <div class="photograph" tabindex="0" ref="frame" @keydown="key">
      <svg ref="svg" :viewBox="[x, y, w, h].join(' ')" @wheel.prevent="wheel" @pointerdown="hold" @pointermove="drag"
        @pointerup="held = null" @dblclick="fit" role="img" :aria-label="name">
        <image v-if="url" :href="url" x="-0.5" y="-0.5" :width="width" :height="height" preserveAspectRatio="xMinYMin"
          :class="{ pixels: unit < 0.2 }" />
        <polyline v-if="order" class="order" :points="corners.map((c) => c[1] + ',' + c[2]).join(' ')" />
        <path class="corner" :d="crosses(corners, 5)" />
        <path class="rejected" :d="crosses(rejected, 5)" />
        <path v-if="arrows.length" class="residual" :d="arrowPath" />
        <circle v-if="corners.length" class="first" :cx="corners[0][1]" :cy="corners[0][2]" :r="9 * unit" />
        <g v-if="order" class="numbers" :font-size="11 * unit">
          <text v-for="c in numbered" :key="c[0]" :x="c[1] + 5 * unit" :y="c[2] - 5 * unit">{{ c[0] }}</text>
        </g>
      </svg>
    </div>`,
  props: {
    name: String,
    url: String,
    width: Number,
    height: Number,
    columns: Number,
    corners: Array,
    rejected: Array,
    arrows: Array,
    order: Boolean,
  },
  data() {
    return { x: -0.5, y: -0.5, w: this.width || 1, h: this.height || 1, unit: 1, held: null };
  },
  watch: {
    width() {
      this.fit();
    },
    height() {
      this.fit();
    },
  },
  mounted() {
    this.seen = new ResizeObserver(() => this.measure());
    this.seen.observe(this.$refs.svg);
    window.addEventListener("keydown", this.step);
  },
  unmounted() {
    this.seen.disconnect();
    window.removeEventListener("keydown", this.step);
  },
  computed: {
    gaps() {
      // between neighbours, in pixels of the photograph: the narrowest along a row, and from row to row
      const at = new Map(this.corners.map(([id, x, y]) => [id, [x, y]]));
      const narrowest = (step) => {
        const far = [...at].map(([id, [x, y]]) => {
          const next = at.get(id + step);
          return next && (step > 1 || (id + 1) % this.columns) ? Math.hypot(next[0] - x, next[1] - y) : Infinity;
        });
        return Math.min(Infinity, ...far);
      };
      return { across: narrowest(1), down: narrowest(this.columns) };
    },
    numbered() {
      // as many as do not lie over each other; at least those at both ends of each n-th row
      const { across, down } = this.gaps;
      const all = across > 30 * this.unit && down > 13 * this.unit;
      const rows = Math.max(1, Math.ceil((13 * this.unit) / down));
      const ends = ([id]) => id % this.columns === 0 || id % this.columns === this.columns - 1;
      return this.corners.filter((c) => all || (ends(c) && Math.floor(c[0] / this.columns) % rows === 0));
    },
    arrowPath() {
      return this.corners
        .map(([, x, y], n) => {
          const [dx, dy] = this.arrows[n];
          if (dx === null) return "";
          const [ax, ay] = [x + dx, y + dy];
          return `M${x} ${y}L${ax} ${ay}M${ax - 0.3 * dx + 0.15 * dy} ${ay - 0.3 * dy - 0.15 * dx}L${ax} ${ay}L${
            ax - 0.3 * dx - 0.15 * dy
          } ${ay - 0.3 * dy + 0.15 * dx}`;
        })
        .join("");
    },
  },
  methods: {
    crosses(corners, size) {
      const r = size * this.unit;
      return corners.map(([, x, y]) => `M${x - r} ${y}h${2 * r}M${x} ${y - r}v${2 * r}`).join("");
    },
    fit() {
      [this.x, this.y, this.w, this.h] = [-0.5, -0.5, this.width, this.height];
      this.measure();
    },
    measure() {
      const svg = this.$refs.svg;
      const box = svg?.getBoundingClientRect();
      if (!box?.width) return;
      const zoom = svg.currentCSSZoom ?? 1; // large screens show the whole page larger
      this.unit = zoom * Math.max(this.w / box.width, this.h / box.height); // pixels of the photograph for one of the page
    },
    at(event) {
      const matrix = this.$refs.svg.getScreenCTM().inverse();
      return new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
    },
    zoom(factor, x, y) {
      const w = Math.min(this.width * 2, Math.max(4, this.w / factor));
      const ratio = w / this.w;
      this.x = x - (x - this.x) * ratio;
      this.y = y - (y - this.y) * ratio;
      this.w = w;
      this.h *= ratio;
      this.measure();
    },
    wheel(event) {
      const point = this.at(event);
      this.zoom(Math.exp(-event.deltaY / 400), point.x, point.y);
    },
    hold(event) {
      this.held = this.at(event);
    },
    drag(event) {
      if (!this.held || !event.buttons) return;
      const point = this.at(event);
      this.x -= point.x - this.held.x;
      this.y -= point.y - this.held.y;
    },
    magnify(factor) {
      this.zoom(factor, this.x + this.w / 2, this.y + this.h / 2);
    },
    key(event) {
      if (event.key === "+" || event.key === "=") this.magnify(1.5);
      else if (event.key === "-") this.magnify(1 / 1.5);
      else if (event.key === "0") this.fit();
      else return;
      event.preventDefault();
    },
    step(event) {
      const steps = { ArrowLeft: -1, ArrowRight: 1 };
      if (!(event.key in steps) || event.altKey || event.ctrlKey || event.metaKey) return;
      if (event.target.closest?.("input, textarea, select, [role=tab], [role=combobox], [role=slider]")) return;
      event.preventDefault();
      this.$emit("step", steps[event.key]);
    },
  },
};
