// The button for the page's colours: as the system has them, dark, or light. The browser keeps what was chosen.
const CHOICES = [
  { name: "as the system", icon: "brightness_auto", dark: "auto", scheme: "normal" },
  { name: "dark", icon: "dark_mode", dark: true, scheme: "dark" },
  { name: "light", icon: "light_mode", dark: false, scheme: "light" },
];
const KEPT = "opencsp-calib-colours";

export default {
  template: `<q-btn flat round dense :icon="now.icon" :aria-label="'Colours: ' + now.name" @click="turn" />`,
  data() {
    return { index: Math.max(0, CHOICES.findIndex((choice) => choice.name === localStorage.getItem(KEPT))) };
  },
  mounted() {
    if (this.index) this.show();
  },
  computed: {
    now() {
      return CHOICES[this.index];
    },
  },
  methods: {
    turn() {
      this.index = (this.index + 1) % CHOICES.length;
      localStorage.setItem(KEPT, this.now.name);
      this.show();
    },
    show() {
      Quasar.Dark.set(this.now.dark);
      document.getElementById("nicegui-color-scheme").content = this.now.scheme;
    },
  },
};
