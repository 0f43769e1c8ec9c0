// Which of some panels is seen. Set here, beside Vue, which would draw all within a panel anew for a class of its own.
export default {
  template: `<i></i>`,
  props: { name: String },
  mounted() {
    this.show();
  },
  watch: {
    name() {
      this.show();
    },
  },
  methods: {
    show() {
      for (const panel of this.$el.closest(".panels").querySelectorAll(":scope > [role=tabpanel]"))
        panel.ariaHidden = panel.classList.toggle("behind", panel.ariaLabel !== this.name);
    },
  },
};
