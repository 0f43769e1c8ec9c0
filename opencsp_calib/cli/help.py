"""The help of a command: plain text, in sections, which starts in half the time that boxes take."""

from typing import Any

from typer.core import TyperCommand

__all__ = ["CommandWithSections", "first_line"]


class CommandWithSections(TyperCommand):
    """A command whose help lists its options under the heading that each names."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments and options, section by section."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            heading = "Arguments" if parameter.param_type_name == "argument" else "Options"
            heading = getattr(parameter, "rich_help_panel", None) or heading
            record = parameter.get_help_record(ctx)
            if record is not None:
                sections.setdefault(heading, []).append(record)
        for heading, records in sections.items():
            with formatter.section(heading):
                formatter.write_dl(records)


def first_line(command: Any) -> str:
    """What the list of commands says of this one: all of the line, where a list would cut it."""
    return (command.__doc__ or "").partition("\n")[0]
