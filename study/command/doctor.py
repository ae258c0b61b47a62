"""``stickslip doctor``: list requirements that this machine does not meet."""

from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app(
    "doctor",
    "Looks for system libraries and Python packages, draws a test picture without a screen, and checks the folder of "
    "stored results. Exit code 0 if all requirements are met, 1 if something is missing.",
    examples=["stickslip doctor", "stickslip doctor --json"],
)


@app.default
def doctor(*, options: Options = DEFAULTS) -> Answer:
    """Examine this machine."""
    from study.doctor import examine, make_install_command

    findings = examine(options.cache_folder)
    repair = make_install_command(findings)
    lines = [f"  {finding.verdict:8} {finding.subject}: {finding.detail}" for finding in findings]
    if repair:
        lines += ["", "To install what is missing:", "", f"  {repair}"]
    healthy = not any(finding.is_needed for finding in findings if finding.verdict == "missing")
    lines += ["", "All requirements are met." if healthy else "A requirement is missing."]
    document = {
        "healthy": healthy,
        "findings": [
            {
                "subject": finding.subject,
                "verdict": finding.verdict,
                "needed": finding.is_needed,
                "detail": finding.detail,
            }
            for finding in findings
        ],
        "repair": repair,
    }
    return Answer(document=document, text="\n".join(lines), exit_code=0 if healthy else 1)
