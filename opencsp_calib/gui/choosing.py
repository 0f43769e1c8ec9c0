"""Which photographs are selected in a table, shared by all tables of the page."""

from typing import TYPE_CHECKING, Any

from nicegui import ui

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["fill", "photograph_table"]

NAME_CELL = (
    '<q-td :props="props"><a class="name" href="#" role="button" '
    "@click.stop.prevent=\"$parent.$emit('look', props.row.image)\">{{ props.row.image }}</a></q-td>"
)


def photograph_table(page: "Page", columns: list[dict[str, Any]]) -> ui.table:
    """A table whose rows are photographs: a click selects one, one on its name opens it."""

    def selected() -> None:
        here = {row["image"] for row in table.rows}
        page.selected = (page.selected - here) | {row["image"] for row in table.selected}
        page.refresh()

    def clicked(event: Any) -> None:
        page.selected ^= {event.args[1]["image"]}
        page.refresh()

    table = ui.table(
        columns=columns,
        rows=[],
        row_key="image",
        selection="multiple",
        pagination={"rowsPerPage": 0},
        on_select=selected,
    )
    table.add_slot("body-cell-image", NAME_CELL)
    table.on("rowClick", clicked).on("look", lambda event: page.look_at(event.args))
    return table.props("flat dense hide-bottom")


def fill(page: "Page", table: ui.table, rows: list[dict[str, Any]]) -> None:
    """Show rows, and which of them are selected."""
    if rows != table.rows:
        table.rows = rows
    chosen = [row for row in rows if row["image"] in page.selected]
    if chosen != table.selected:
        table.selected = chosen
