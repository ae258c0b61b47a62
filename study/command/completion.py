"""``stickslip completion``: print a script that completes commands and options in a shell."""

from typing import Annotated, Literal

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app(
    "completion",
    """Prints a script that lets the Tab key complete commands and options. Load it in the running shell, or save it
    where the shell looks for such scripts; nothing else is changed.""",
    examples=[
        'eval "$(stickslip completion bash)"',
        "stickslip completion bash > ~/.local/share/bash-completion/completions/stickslip",
        "stickslip completion zsh > ~/.zsh/completions/_stickslip",
        "stickslip completion fish > ~/.config/fish/completions/stickslip.fish",
    ],
)

Shell = Literal["bash", "zsh", "fish"]


@app.default
def completion(
    shell: Annotated[Shell, Parameter(help="The shell.")] = "bash", /, *, options: Options = DEFAULTS
) -> Answer:
    """Print a completion script."""
    from study.cli import make_command_line

    del options
    script = make_command_line().generate_completion(shell=shell)
    return Answer(document={"shell": shell, "script": script}, text=script.rstrip("\n"))
