"""E00xx and W000x: the file cannot be read, is not YAML, or is YAML that specc leaves out."""

from specc.diagnostics.code import Code

_PASSING = "specc: 1\nsystem: demo\n"

CODES = (
    Code(
        "E0001",
        "file not found",
        "There is no file at the path that was given on the command line or in a specification, "
        "or a directory or pattern leads to none. "
        "Paths inside a specification are relative to the file that names them.",
        "$ specc validate no_such_file.yaml",
        "$ specc validate demo.yaml",
    ),
    Code(
        "E0002",
        "not a file",
        "The path names a directory, a pipe or a device. A specification is read from a regular "
        "file, because its diagnostics point into it.",
        "$ mkdir specs.yaml; specc build specs.yaml",
        "$ specc build demo.yaml",
    ),
    Code(
        "E0003",
        "file cannot be read",
        "The operating system refused to open the file, usually for lack of permission.",
        "$ ln -s loop.yaml loop.yaml; specc validate loop.yaml    # a link to itself",
        "$ ln -s demo.yaml link.yaml; specc validate link.yaml",
    ),
    Code(
        "E0004",
        "file too large",
        "The file is larger than 2 MB. Specifications are written by people; a file of that size "
        "is a log, a model or an image that was named by mistake.",
        "$ specc validate recording.mcap",
        "$ specc validate demo.yaml",
    ),
    Code(
        "E0005",
        "not UTF-8",
        "Specifications are text in UTF-8. The file has a byte that no UTF-8 text has at that "
        "place; it was saved in another encoding, or it is no text.",
        "$ printf 'specc: 1\\nsystem: demo\\ntitle: caf\\xe9\\n' > spec.yaml\n"
        "$ specc validate spec.yaml",
        "$ printf 'specc: 1\\nsystem: demo\\ntitle: caf\\xc3\\xa9\\n' > spec.yaml\n"
        "$ specc validate spec.yaml",
    ),
    Code(
        "E0006",
        "forbidden character",
        "YAML forbids control characters, and specc also refuses the line separators U+0085, "
        "U+2028 and U+2029, which YAML parsers and editors count differently. In double quotes "
        "all of them can be written as escapes.",
        'title: "bell \x07"',
        'title: "bell \\x07"',
        "yaml",
    ),
    Code(
        "E0007",
        "empty file",
        "The file has no value at all: it is empty or holds only comments.",
        "# nothing here yet",
        _PASSING,
        "yaml",
    ),
    Code(
        "E0008",
        "several documents in a file",
        "YAML can put several documents in a file, separated by `---`. A specification is one "
        "document; what belongs to another file is named by its path.",
        "specc: 1\nsystem: demo\n---\nspecc: 1\nsystem: other\n",
        _PASSING,
        "yaml",
    ),
    Code(
        "E0009",
        "not YAML",
        "The text breaks the grammar of YAML: a quote or bracket is not closed, a line is "
        "indented by too little or too much, or a value has characters that need quotes. Types "
        "such as pose[B, E] need quotes inside { } and [ ].",
        "x: {T_d: pose[B, E]}",
        'x: {T_d: "pose[B, E]"}',
        "yaml",
    ),
    Code(
        "E0010",
        "tab in indentation",
        "YAML allows only spaces in indentation, because editors show tabs at different widths.",
        "agents:\n\tirp: {}\n",
        "agents:\n  irp: {}\n",
        "yaml",
    ),
    Code(
        "E0011",
        "duplicate key",
        "A mapping has the same key twice. Many YAML readers keep the last one silently; here "
        "one of two behaviours or buffers would vanish.",
        "functions:\n  hold: {eq: 14}\n  hold: {eq: 15}\n",
        "functions:\n  hold: {eq: 14}\n  sense: {eq: 15}\n",
        "yaml",
    ),
    Code(
        "E0012",
        "not a key",
        "The keys of a mapping are names. A key that is empty, null, a list, a mapping or an "
        "alias names nothing. Inside braces a comma ends a text unless quotes stand around it, and "
        "what follows is read as a key.",
        "frames:\n  ~: robot base\n",
        "frames:\n  B: robot base\n",
        "yaml",
    ),
    Code(
        "E0013",
        "merge key",
        "`<<` is no part of YAML 1.2, and values that appear from elsewhere make a specification "
        "hard to read. Descriptions are shared by files that are used with parameters.",
        "k: &defaults {rate: 500 Hz}\nm:\n  <<: *defaults\n",
        "k: {rate: 500 Hz}\nm: {rate: 500 Hz}\n",
        "yaml",
    ),
    Code(
        "E0014",
        "tag",
        "Tags such as !!str or !include change what a value is behind the reader's back. Quotes "
        "make text; anything else is what it looks like.",
        "title: !!str 5",
        'title: "5"',
        "yaml",
    ),
    Code(
        "E0015",
        "alias without a value",
        "An alias `*name` stands for the value after the anchor `&name`, which must be complete "
        "earlier in the file. An alias inside its own value would have no end.",
        "a: *limits\nb: &limits [0, 1]\n",
        "a: &limits [0, 1]\nb: *limits\n",
        "yaml",
    ),
    Code(
        "E0016",
        "nested too deep",
        "Values, types in types, or files that use files are nested more than 64 levels deep. No "
        "part of a specification is nested deeper than a dozen levels.",
        "a: " + "[" * 65 + "]" * 65,
        "a: [[[]]]",
        "yaml",
    ),
    Code(
        "E0017",
        "too many values",
        "With aliases written out, the files of a specification hold at most 100000 values, a "
        "mapping at most 2000 keys, and a file at most 400 agents, subsystems and devices; a "
        "specification uses at most 200 files, and a type has at most 2000 parts with the types in "
        "it written out, as has an expression with the constants of a description. A few lines of "
        "aliases to aliases, or of records of records, can stand for billions; the limits keep "
        "specc from trying.",
        "a: &a [x, x, x, x, x, x, x, x, x, x]\n"
        "b: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a, *a]\n"
        "c: &c [*b, *b, *b, *b, *b, *b, *b, *b, *b, *b]\n"
        "d: &d [*c, *c, *c, *c, *c, *c, *c, *c, *c, *c]\n"
        "e: &e [*d, *d, *d, *d, *d, *d, *d, *d, *d, *d]\n"
        "f: &f [*e, *e, *e, *e, *e, *e, *e, *e, *e, *e]\n",
        "a: &a [x, x, x]\nb: [*a, *a, *a]\n",
        "yaml",
    ),
    Code(
        "E0018",
        "number out of range",
        "A whole number does not fit 64 bits, or a decimal number does not fit a double and "
        "would become infinite.",
        "gain: 1e999",
        "gain: 1e9",
        "yaml",
    ),
    Code(
        "E0021",
        "file outside the project",
        "`use`, `files`, the model of a plant and what it includes name files inside the project: "
        "the folder of the specification, or of the nearest pyproject.toml above it, links "
        "resolved. Nothing is read beyond it, and `fmt` and `build` write nothing there. A folder "
        "elsewhere is allowed by `allow` in `[tool.specc]`.",
        "specc: 1\nsystem: demo\nuse: [../shared/frames.yaml]\n",
        "specc: 1\nsystem: demo\nuse: [lib/frames.yaml]\n",
    ),
    Code(
        "E0022",
        "not a specification",
        "What is used has no `specc: 1`. Nothing of its text is shown.",
        "specc: 1\nsystem: demo\nuse: [notes.txt]\n",
        "specc: 1\nsystem: demo\nuse: [lib/frames.yaml]\n",
    ),
    Code(
        "W0001",
        "byte order mark",
        "The file starts with the mark U+FEFF. UTF-8 needs none; other tools may take it for a "
        "part of the first key.",
        "$ printf '\\xef\\xbb\\xbfspecc: 1\\nsystem: demo\\n' > spec.yaml\n"
        "$ specc validate spec.yaml",
        "$ printf 'specc: 1\\nsystem: demo\\n' > spec.yaml\n$ specc validate spec.yaml",
    ),
)
