// Lines in space, to be turned by dragging or with the arrow keys, and brought nearer with the wheel or + and -.
export default {
  template: `
    <svg class="space" tabindex="0" role="img" :aria-label="label" :viewBox="[-size, -size * 0.75, 2 * size, 1.5 * size].join(' ')"
      @pointerdown="hold" @pointermove="drag" @pointerup="held = null" @wheel.prevent="scale(Math.exp(-$event.deltaY / 500))"
      @keydown="key">
      <g v-for="line in drawn" :class="line.kind" @click="$emit('chosen', line.name)">
        <title>{{ line.name }}</title>
        <polyline :points="line.points" vector-effect="non-scaling-stroke" />
      </g>
    </svg>`,
  props: { lines: Array, label: String, turn: Array },
  data() {
    const [yaw, pitch] = this.turn;
    return { yaw, pitch, zoom: 1, held: null, size: 1 };
  },
  computed: {
    extent() {
      const all = this.lines.flatMap((line) => line.points);
      const middle = [0, 1, 2].map((axis) => {
        const values = all.map((point) => point[axis]);
        return all.length ? (Math.min(...values) + Math.max(...values)) / 2 : 0;
      });
      const radius = Math.max(1e-9, ...all.map((point) => Math.hypot(...point.map((value, axis) => value - middle[axis]))));
      return { middle, radius };
    },
    drawn() {
      const { middle, radius } = this.extent;
      const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
      const enlarged = (0.74 * this.zoom) / radius;
      const flat = (point) => {
        const [x, y, z] = point.map((value, axis) => value - middle[axis]);
        const across = cy * x + sy * z;
        const deep = cy * z - sy * x;
        return `${(enlarged * across).toFixed(5)},${(enlarged * (cp * y - sp * deep)).toFixed(5)}`;
      };
      return this.lines.map((line) => ({ ...line, points: line.points.map(flat).join(" ") }));
    },
  },
  methods: {
    hold(event) {
      this.held = [event.clientX, event.clientY];
    },
    drag(event) {
      if (!this.held || !event.buttons) return;
      this.yaw += (event.clientX - this.held[0]) / 200;
      this.pitch += (event.clientY - this.held[1]) / 200;
      this.held = [event.clientX, event.clientY];
    },
    scale(factor) {
      this.zoom = Math.min(50, Math.max(0.2, this.zoom * factor));
    },
    key(event) {
      const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
      if (event.key in turns) {
        this.yaw += turns[event.key][0];
        this.pitch += turns[event.key][1];
      } else if (event.key === "+") this.scale(1.2);
      else if (event.key === "-") this.scale(1 / 1.2);
      else return;
      event.preventDefault();
    },
  },
};
