"""E009x: the output of `specc build` cannot be put where it was asked for."""

from textwrap import fill

from specc.diagnostics.code import Code


def _lets(count: int) -> str:
    lets = ", ".join(
        f"a{number}: a{number - 1} * a{number - 1} if n > {number} else a{number - 1}"
        for number in range(1, count)
    )
    text = fill(f"let: {{a0: n, {lets}}}", 90, subsequent_indent="  ")
    return (
        f"memory: {{n: {{type: int, init: 0}}}}\n{text}\n"
        f"functions: {{keep: {{n: a{count - 1}}}}}\n"
        "behaviours: {idle: {functions: [hold, sense, keep]}}\n"
    )


CODES = (
    Code(
        "E0090",
        "output cannot be written",
        "The operating system refused to create or replace a file of the output. What was there "
        "before is still there.",
        "$ specc build demo.yaml --out demo.yaml/generated    # below a file",
        "$ specc build demo.yaml --out generated",
    ),
    Code(
        "E0091",
        "output directory holds other files",
        "`specc build` replaces the directory of a system as a whole, so that no file of an "
        "earlier build survives. It refuses to do so to a directory that it did not write.",
        "$ mkdir -p generated/demo; touch generated/demo/notes.txt; specc build demo.yaml",
        "$ specc build demo.yaml --out elsewhere",
    ),
    Code(
        "E0092",
        "output is not up to date",
        "`specc build --check` found that a build would change, add or remove this file. The "
        "output is committed so that it can be read and reviewed; it has to match its spec.",
        "$ specc build demo.yaml; sed -i s/10/20/ demo.yaml; specc build --check demo.yaml",
        "$ specc build demo.yaml; specc build --check demo.yaml",
    ),
    Code(
        "E0093",
        "work cycle is beyond reason",
        "A method of the generated code would hold more terms than anybody reads, or terms nested "
        "deeper than Python takes. Lets that choose between lets multiply.",
        _lets(40),
        _lets(4),
        "subsystem",
    ),
    Code(
        "E0094",
        "generated code cannot be formatted",
        "The formatter is not installed, or it refused the generated text, which is then kept for "
        "inspection.",
        "$ pip uninstall ruff; specc build demo.yaml",
        "$ pip install ruff; specc build demo.yaml",
    ),
)
