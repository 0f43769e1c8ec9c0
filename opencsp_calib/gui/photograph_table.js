// A table whose rows are photographs: a click selects one, one on its name opens it, one on a column's name sorts.
// Its rows come as one text, and a row is drawn anew only when it changes: the page must answer while hundreds come in.
export default {
  template: `
    <div class="photographs">
      <table>
        <thead>
          <tr>
            <th class="box"><input type="checkbox" aria-label="All" :checked="all" :indeterminate="some && !all" @change="pickAll" /></th>
            <th v-for="column in columns" :key="column.name" :class="column.align" :data-column="column.name" :aria-sort="order(column)">
              <button v-if="column.sortable" type="button" @click="sort(column.name)">{{ column.label }}</button>
              <template v-else>{{ column.label }}</template>
            </th>
          </tr>
        </thead>
        <tbody>
          <tr v-for="row in sorted" :key="row.image" v-memo="[row.text, picked.has(row.image)]"
            :class="{ picked: picked.has(row.image) }" @click="toggle(row.image)">
            <td class="box" @click.stop>
              <input type="checkbox" :aria-label="row.image" :checked="picked.has(row.image)" @change="toggle(row.image)" />
            </td>
            <td v-for="column in columns" :key="column.name" :class="column.align" :data-column="column.name">
              <template v-if="column.name === 'picture'">
                <img v-if="row.picture" class="thumbnail" loading="lazy" :src="row.picture" alt="" />
                <div v-else class="thumbnail"></div>
              </template>
              <button v-else-if="column.name === 'image'" type="button" class="name" @click.stop="$emit('look', row.image)">{{
                row.image
              }}</button>
              <template v-else>{{ row[column.name] }}</template>
            </td>
          </tr>
        </tbody>
      </table>
    </div>`,
  props: { columns: Array, rows: String, selected: Array },
  emits: ["select", "look"],
  data() {
    return { picked: new Set(this.selected), by: "", descending: false };
  },
  watch: {
    selected(names) {
      this.picked = new Set(names);
    },
  },
  computed: {
    parsed() {
      return JSON.parse(this.rows).map((row) => Object.freeze({ ...row, text: JSON.stringify(row) }));
    },
    sorted() {
      if (!this.by) return this.parsed;
      const { compare } = new Intl.Collator(undefined, { numeric: true });
      const value = (row) => String(row[this.by] ?? "");
      const rows = [...this.parsed].sort((a, b) => compare(value(a), value(b)));
      return this.descending ? rows.reverse() : rows;
    },
    some() {
      return this.picked.size > 0;
    },
    all() {
      return this.some && this.picked.size === this.parsed.length;
    },
  },
  methods: {
    order(column) {
      if (!column.sortable) return undefined;
      return this.by !== column.name ? "none" : this.descending ? "descending" : "ascending";
    },
    sort(name) {
      if (this.by !== name) [this.by, this.descending] = [name, false];
      else if (!this.descending) this.descending = true;
      else this.by = ""; // in order of capture again
    },
    pick(names) {
      this.picked = new Set(names);
      this.$emit("select", [...names]);
    },
    pickAll() {
      this.pick(this.all ? [] : this.parsed.map((row) => row.image));
    },
    toggle(image) {
      this.pick(this.picked.has(image) ? [...this.picked].filter((one) => one !== image) : [...this.picked, image]);
    },
  },
};
