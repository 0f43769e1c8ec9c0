// A table whose rows are photographs: a click selects one, one on its name opens it.
// It is drawn anew only when its own rows or selection change, not with every other element of the page.
export default {
  template: `
    <q-table flat dense hide-bottom row-key="image" selection="multiple" :columns="columns" :rows="rows" :selected="picked"
      :pagination="all" @update:selected="pick" @row-click="toggle">
      <template #body-cell-picture="cell">
        <q-td :props="cell"><img class="thumbnail" loading="lazy" :src="cell.row.picture" alt="" /></q-td>
      </template>
      <template #body-cell-image="cell">
        <q-td :props="cell">
          <a class="name" href="#" role="button" @click.stop.prevent="$emit('look', cell.row.image)">{{ cell.row.image }}</a>
        </q-td>
      </template>
    </q-table>`,
  props: { columns: Array, rows: Array, selected: Array },
  emits: ["select", "look"],
  data() {
    return { names: this.selected, all: { rowsPerPage: 0 } };
  },
  watch: {
    selected(names) {
      this.names = names;
    },
  },
  computed: {
    picked() {
      const names = new Set(this.names);
      return this.rows.filter((row) => names.has(row.image));
    },
  },
  methods: {
    pick(rows) {
      this.names = rows.map((row) => row.image);
      this.$emit("select", this.names);
    },
    toggle(_, row) {
      this.pick(this.picked.includes(row) ? this.picked.filter((one) => one !== row) : [...this.picked, row]);
    },
  },
};
