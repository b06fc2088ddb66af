"""doctor: what this machine lacks."""

import typer

from barberpole.commands.console import AS_JSON, OUT, print_json, table


def register(app: typer.Typer) -> None:
    """Add this command to the roof."""
    app.command()(doctor)


def doctor(as_json: bool = AS_JSON) -> int:
    """What this machine has and lacks for barberpole. Exit 1 if something needed is missing."""
    from barberpole.doctor import by_extra, examine, remedy

    findings = examine()
    lacking = [finding for finding in findings if finding.needed and not finding.ok]
    if as_json:
        print_json({"ok": not lacking, "findings": [finding.to_json() for finding in findings]})
        return 1 if lacking else 0
    shown = table("", "what", "state", "found", "for")
    for column in shown.columns:
        column.justify = "left"
    for finding in by_extra(findings):
        state = "ok" if finding.ok else "MISSING" if finding.needed else "not here"
        shown.add_row(finding.what, state, finding.found, finding.serves)
    OUT.print(shown)
    if lacking:
        OUT.print(f"missing: {', '.join(finding.what for finding in lacking)}", style="bold")
    else:
        OUT.print("All that is needed is here.", style="bold")
    twin = [finding for finding in findings if finding.extra == "twin" and not finding.ok]
    if twin and not lacking:
        OUT.print(f"For `demo` and `twin`, which need an emulated board: {remedy(twin)}")
    elif remedy(lacking):
        OUT.print(remedy(lacking))
    return 1 if lacking else 0
