// A part of the page that is drawn anew by itself: what changes within it costs nothing elsewhere, nor the other way round.
export default {
  template: `<component :is="tag"><slot /></component>`,
  props: { tag: String },
};
