"""Makes named types: each of its definition, for the frames that are given to it."""

from __future__ import annotations

from dataclasses import dataclass, field

from specc.lang import FOLLOW_UP, ExprError, TypeNames, parse_type
from specc.limits import MAX_DEPTH, MAX_TYPE_PARTS
from specc.model.types import Enum, Frame, Opaque, Record, Type
from specc.resolve.context import Cursor, Findings, TypeText
from specc.resolve.definitions import Definitions
from specc.schema.files import TypeDef


@dataclass(eq=False, slots=True)
class TypeMaker:
    """Makes the type of a name, for given frames; a type that contains itself is an error."""

    name: str
    definition: TypeDef
    where: Cursor
    definitions: Definitions
    findings: Findings
    _made: dict[tuple[Frame, ...], Type] = field(default_factory=dict)
    _making: bool = False
    _broken: bool = False
    _enum: Type | None = None

    def __call__(self, frames: tuple[Frame, ...]) -> Type:
        """The type with these frames; raises `ExprError` if they do not suit it."""
        if frames not in self._made:
            self._made[frames] = self._bounded(frames)
        return self._made[frames]

    def _bounded(self, frames: tuple[Frame, ...]) -> Type:
        if len(frames) != len(self.definition.frames):
            wanted = len(self.definition.frames)
            raise ExprError(
                f"type `{self.name}` takes {wanted} frames, not {len(frames)}",
                0,
                0,
                f"write `{self.name}[{', '.join(self.definition.frames)}]` with frames of yours"
                if wanted
                else f"write `{self.name}`",
                "E0306",
            )
        if self._making:
            message, help_text = f"type `{self.name}` contains itself", "break the circle"
            raise ExprError(message, 0, 0, help_text, "E0306")
        self._making = True
        self.findings.depth += 1
        try:
            if self.findings.depth > MAX_DEPTH:
                message = f"types are more than {MAX_DEPTH} levels deep"
                raise ExprError(message, 0, 0, _TOO_LARGE, "E0016")
            made = self._make(frames)
        finally:
            self._making = False
            self.findings.depth -= 1
        parts, levels = made.extent
        whole = f"with the types in it written out, `{self.name}`"
        if levels > MAX_DEPTH:
            raise self._refused(f"{whole} is more than {MAX_DEPTH} levels deep", "E0016")
        if parts > MAX_TYPE_PARTS:
            raise self._refused(f"{whole} has more than {MAX_TYPE_PARTS} parts", "E0017")
        return made

    def enum(self) -> Type | None:
        """The type if it is an enum; made once."""
        if self._enum is None and (self.definition.type or "").lstrip().startswith("enum"):
            try:
                self._enum = self(())
            except ExprError:
                return None
        return self._enum

    def check(self, frames: tuple[Frame, ...]) -> None:
        """Report what is wrong with the definition, once, at its own place."""
        given = [self.definition.type, self.definition.fields, self.definition.opaque]
        if sum(part is not None for part in given) != 1:
            message = f"type `{self.name}` needs one of `type`, `fields` and `opaque`"
            help_text = "keep the one that says what the type is"
            self.findings.report("E0104", message, self.where.place, help=help_text)
            return
        if self.definition.codec is not None and not self.definition.opaque:
            message = f"type `{self.name}` has a codec and is not opaque"
            help_text = "remove `codec`: values of all other types are recorded as they are"
            self.findings.report("E0104", message, self.where["codec"].place, help=help_text)
        self._note(frames)
        try:
            self(frames)
        except ExprError as error:
            self.findings.expression_error(self.where.scalar("type"), error)

    def _note(self, frames: tuple[Frame, ...]) -> None:
        """Note for editors which texts of types the definition has."""
        given, known = self.definition, self.definitions
        local = known.frames | dict(zip(given.frames, frames, strict=True))
        names = TypeNames(local, known.types, known.sizes)
        texts = [(self.where["fields"][n], text) for n, text in (given.fields or {}).items()]
        texts += [(self.where.scalar("type"), given.type)] if given.type else []
        notes = (TypeText(at, "type", text, names, known.places) for at, text in texts)
        self.findings.types.extend(notes)

    def _refused(self, message: str, code: str) -> ExprError:
        """Report that the type is too large, here and nowhere else."""
        error = ExprError(message, 0, 0, _TOO_LARGE, code)
        self.findings.expression_error(self.where.scalar("type"), error)
        self._broken = True
        return ExprError(message, 0, 0, code=FOLLOW_UP)

    def _parsed(self, where: Cursor, text: str, names: TypeNames) -> Type:
        """A type in the definition; what is wrong with it is reported here and nowhere else."""
        if not self._broken:
            try:
                return parse_type(text, names)
            except ExprError as error:
                self.findings.expression_error(where, error)
                self._broken = True
        raise ExprError(f"type `{self.name}` has an error", 0, 0, code=FOLLOW_UP)

    def _make(self, frames: tuple[Frame, ...]) -> Type:
        definition = self.definition
        local = dict(zip(definition.frames, frames, strict=True))
        known = self.definitions
        names = TypeNames(known.frames | local, known.types, known.sizes)
        if definition.opaque:
            codec = definition.codec
            functions = (codec.encode, codec.decode) if codec else ()
            return Opaque(self.name, frames, definition.python or "", functions)
        if definition.fields is not None:
            texts, at = definition.fields.items(), self.where["fields"]
            fields = tuple((n, self._parsed(at[n], t, names)) for n, t in texts)
            return Record(self.name, frames, fields, definition.python or "")
        made = self._parsed(self.where.scalar("type"), definition.type or "", names)
        return Enum(self.name, made.members) if isinstance(made, Enum) else made


_TOO_LARGE = "use an opaque type for a part"
