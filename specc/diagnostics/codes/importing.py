"""E08xx and W080x: what is found in files of other tools when they are imported."""

from specc.diagnostics.code import Code

_HEAD = "<subsystem_definition><buffers/><predicates>"
_REST = (
    '</predicates><behaviors><behavior name="b" stop_cond="TRUE" err_cond="FALSE"/></behaviors>'
    '<states initial="s"><state name="s"><behavior name="b"/>'
    '<next_state name="s" init_cond="%s"/></state></states></subsystem_definition>'
)


def _fabric(predicates: str = "", condition: str = "TRUE") -> str:
    text = _HEAD + predicates + _REST % condition
    return f"$ echo '{text}' > a.xml; specc import fabric a.xml"


def _scxml(content: str, attributes: str = 'initial="s"') -> str:
    return f"$ echo '<scxml {attributes}>{content}</scxml>' > a.scxml; specc import scxml a.scxml"


_FLAT = '<state id="s"><transition event="go" target="s"/></state>'
_P = '<predicate name="p"/>'

CODES = (
    Code(
        "E0801",
        "not XML",
        "The file that is imported is not one well-formed XML document, or has more than 100 "
        "levels or 50 000 elements.",
        "$ echo '<scxml><state>' > a.scxml; specc import scxml a.scxml",
        _scxml(_FLAT),
    ),
    Code(
        "E0802",
        "document type in an imported file",
        "The formats that are imported have no document type. With one, a short file can stand "
        "for an endless text, or for other files of the machine.",
        "$ echo '<!DOCTYPE scxml><scxml/>' > a.scxml; specc import scxml a.scxml",
        _scxml(_FLAT),
    ),
    Code(
        "E0803",
        "file of another kind",
        "The outermost element of the file is not that of the format that was named.",
        "$ echo '<robot/>' > a.xml; specc import fabric a.xml",
        _fabric(),
    ),
    Code(
        "E0804",
        "imported file is not whole",
        "An element or attribute that the format demands is missing, or its value is not one "
        "that it may have.",
        "$ echo '<scxml/>' > a.scxml; specc import scxml a.scxml",
        _scxml(_FLAT),
    ),
    Code(
        "E0805",
        "unknown name in an imported file",
        "The file refers to a state, behavior, predicate or buffer that it does not declare.",
        _fabric(condition="p"),
        _fabric(_P, "p"),
    ),
    Code(
        "E0806",
        "name that an imported file has twice",
        "Two things of one kind have one name, so it is not clear which is meant where the name "
        "is used.",
        _fabric(_P + _P),
        _fabric(_P),
    ),
    Code(
        "E0807",
        "not a condition of FABRIC",
        "A condition joins predicates, `TRUE` and `FALSE` by `and`, `or`, `not` and brackets.",
        _fabric(_P, "p and"),
        _fabric(_P, "p and not p"),
    ),
    Code(
        "E0808",
        "chart that is not flat",
        "A subsystem is one flat Moore machine (2.4): it is in one state, and states have no "
        "states in them. A chart with nested or parallel states, history or several targets of "
        "a transition has to be flattened first; what it means would be lost otherwise.",
        _scxml('<state id="s"><state id="t"/></state>'),
        _scxml(_FLAT),
    ),
    Code(
        "W0801",
        "not carried over",
        "The specification has nothing for this part of the imported file. It is also listed at "
        "the head of the specification, so that somebody decides whether it matters.",
        _scxml('<state id="s"><onentry><log expr="1"/></onentry></state>') + " --period 0.01",
        _scxml(_FLAT) + " --period 0.01",
    ),
    Code(
        "W0802",
        "carried over in another form",
        "The specification says it differently from the imported file, or something was assumed "
        "that the file does not say. It is also listed at the head of the specification.",
        _scxml(_FLAT),
        _scxml(_FLAT) + " --period 0.01",
    ),
)
