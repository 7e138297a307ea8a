"""The settings of line.toml, as line.py writes them for C++, Python and the page."""

from line_names import hpp_head


class Value:
    """One field of a command that people set."""

    def __init__(self, entry, command, ranges):
        self.field = command.field(entry["field"])
        self.info = entry["info"]
        self.python = entry.get("python", self.info)
        self.per = entry.get("per", 1)
        self.whole = self.field.kind != "f32"
        self.range_name = self.field.range
        self.range = ranges[self.range_name]
        self.choices = self.range.get("choices")
        self.words = self.range.get("words")
        self.typed = self.words or self.choices
        self.default = self.range.get("default")
        self.title = entry["title"]
        self.give = entry["give"].format(self.span("one of " + ", ".join(map(str, self.typed or ()))))
        self.text = entry["text"].format(self.span("one of " + ", ".join(map(str, self.typed or ()))), default=self.default)

    def span(self, choices):
        return choices if self.choices else f"{self.range['min'] / self.per:.12g} to {self.range['max'] / self.per:.12g}"


class Setting:
    def __init__(self, entry, line):
        self.name, self.typed, self.label = entry["name"], entry["typed"], entry["label"]
        self.zeros = entry.get("zeros")
        self.command = line.commands[entry["command"]]
        self.capability = self.command.capability
        self.capability_word = next((each["word"] for each in line.capabilities if each["name"] == self.capability), "")
        self.values = [Value(value, self.command, line.ranges) for value in entry["values"]]
        self.typed_choices = self.values[0].typed

        def filled(text, listed=""):
            return text.format(*(value.span(listed) for value in self.values), default=self.values[-1].default)

        choices = [str(each) for each in self.typed_choices or ()]
        self.help = (
            f"{self.name}={'|'.join(choices + [self.zeros] * bool(self.zeros))}"
            if choices
            else f"{self.name}={self.typed} ({filled(entry['help'])})"
        )
        self.give = filled(entry["give"], ", ".join(choices) if self.zeros else ", ".join(choices[:-1]) + " or " + "".join(choices[-1:]))
        self.hint = filled(entry["hint"])


# ---- C++


def line_settings_hpp(line):
    lines = [
        *hpp_head("How people type the settings, and where packets have them. For command.cpp alone.", ("cstddef", "cstdint"), "fingertip"),
        "struct SettingValue {",
        "  double least, most; /* in a packet; that is `per` times what people type */",
        "  const unsigned *choices; /* no other; up to a 0; nullptr: all */",
        "  const char *const *words; /* what people type for each choice; nullptr: the number */",
        "  double unless_given; /* 0: it has to be given */",
        "  unsigned per;",
        "  bool whole;",
        "  double (*now)(const wire_info &info);",
        "  void (*put)(wire_packet &command, double value);",
        "};",
        "",
        "struct Setting {",
        "  const char *name, *typed, *help, *give;",
        "  const char *zeros; /* the word for zeros; nullptr: there is none */",
        "  wire_type command;",
        "  std::uint32_t capability; /* 0: every firmware has it */",
        "  std::size_t count;",
        "  SettingValue values[2];",
        "};",
        "",
    ]
    for value in (value for setting in line.settings for value in setting.values):
        if value.choices:
            lines.append(f"inline constexpr unsigned {value.info}_choices[] = {{{', '.join(map(str, value.choices))}, 0}};")
        if value.words:
            lines.append(
                "inline constexpr const char *" + f"{value.info}_words[] = {{" + ", ".join(f'"{word}"' for word in value.words) + "};"
            )
    lines += ["", "inline constexpr Setting all_settings[] = {"]
    for setting in line.settings:
        zeros = f'"{setting.zeros}"' if setting.zeros else "nullptr"
        capability = f"WIRE_CAPABILITY_{setting.capability}" if setting.capability else "0"
        lines += [
            f'    {{"{setting.name}", "{setting.typed}", "{setting.help}", "{setting.give}", {zeros}, WIRE_CMD_{setting.command.name.upper()}, {capability}, '
            f"{len(setting.values)},",
            "     {",
        ]
        for value in setting.values:
            unit = f"_{value.range['unit']}" if value.range["unit"] else ""
            kind = {"u8": "std::uint8_t", "u16": "std::uint16_t", "u32": "std::uint32_t", "f32": "float"}[value.field.kind]
            lines += [
                f"         {{WIRE_{value.range_name}_MIN{unit}, WIRE_{value.range_name}_MAX{unit}, {f'{value.info}_choices' if value.choices else 'nullptr'}, {f'{value.info}_words' if value.words else 'nullptr'},",
                f"          {'0' if value.default is None else f'WIRE_{value.range_name}_DEFAULT{unit}'}, {value.per}, {'true' if value.whole else 'false'},",
                f"          [](const wire_info &info) -> double {{ return info.{value.info}; }},",
                f"          [](wire_packet &command, double value) {{ command.body.cmd_{setting.command.name}.{value.field.name} = static_cast<{kind}>(value); }}}},",
            ]
        lines += ["     }},"]
    return [*lines, "};", "", "} // namespace fingertip"]


# ---- Python


def python_settings(line):
    """Lines of line.py: the table, and the method that takes them."""
    lines = [
        "class Setting(NamedTuple):",
        '    """An argument of Fingertip.set: a field of a command. In a packet it is `per` times as much."""',
        "",
        "    argument: str",
        "    command: type[Any]",
        "    field: str",
        "    info: str",
        "    least: float",
        "    most: float",
        "    choices: tuple[int, ...]",
        "    words: tuple[str, ...]",
        '    """What is given for each choice, and for 0 the last; none: the number."""',
        "    per: int",
        "    whole: bool",
        "    give: str",
        "    default: float | None",
        "    of: str",
        '    """The capability whose firmware has it; none: every one."""',
        "    needs: str",
        '    """Another argument, without which this one means nothing."""',
        "    zero: bool",
        '    """It may be 0, and so may what needs it."""',
        "",
        "",
        "SETTINGS = (",
    ]
    arguments = []
    for setting in line.settings:
        for value in setting.values:
            first = setting.values[0]
            least, most = (
                (value.choices[0], value.choices[-1]) if value.choices else (value.range["min"] / value.per, value.range["max"] / value.per)
            )
            needs = first.python if value is not first else ""
            lines += [
                f'    Setting("{value.python}", {setting.command.python}, "{value.field.python}", "{value.info}", {least:.12g}, {most:.12g}, {tuple(value.choices or ())}, '
                f'{tuple([*value.words, setting.zeros]) if value.words else ()}, {value.per}, {value.whole}, "{value.give}", {value.default}, "{setting.capability_word}", "{needs}", {bool(setting.zeros)}),'
            ]
            arguments.append(value)
    kinds = {value.python: "str" if value.words else "int" if value.whole and value.per == 1 else "float" for value in arguments}
    lines += [
        ")",
        "",
        "",
        "class Settable:",
        '    """What takes settings."""',
        "",
        "    def set(self, *, " + ", ".join(f"{value.python}: {kinds[value.python]} | None = None" for value in arguments[:3]) + ",",
    ]
    rest = [f"{value.python}: {kinds[value.python]} | None = None" for value in arguments[3:]] + ["keep: bool | None = None"]
    lines += [
        *(f"            {', '.join(rest[i : i + 3])}," for i in range(0, len(rest) - 3, 3)),
        f"            {', '.join(rest[-(len(rest) % 3 or 3) :])}) -> Info:",
        '        """Changes what is given, until power-off; keep True: from now on start with all present settings, False: with the firmware\'s own.',
        "",
    ]
    lines += [f"        {value.python}: {value.text}." for value in arguments]
    lines += [
        "        Raises BadValueError before anything is sent. Returns how it is set now.",
        '        """',
        "        return self._set({" + ", ".join(f'"{value.python}": {value.python}' for value in arguments[:4]) + ",",
        "                          " + ", ".join(f'"{value.python}": {value.python}' for value in arguments[4:]) + "}, keep)",
        "",
        "    def _set(self, given: dict[str, float | str | None], keep: bool | None) -> Info:",
        "        raise NotImplementedError",
        "",
        "",
    ]
    return lines


# ---- the page


def page_settings(line, text_of):
    """Lines of line_facts.ts."""
    lines = ["", "/** What people set, as they type it; in a packet a value is `per` times as much. */", "export const SETTINGS = ["]
    for setting in line.settings:
        capability = f"Capability.{setting.capability}" if setting.capability else "0"
        zeros = f"'{setting.zeros}'" if setting.zeros else "null"
        lines += [
            "  {",
            f"    name: '{setting.name}',",
            f"    label: {text_of(setting.label)},",
            f"    hint: {text_of(setting.hint)},",
            f"    zeros: {zeros},",
            f"    command: PacketType.CMD_{setting.command.name.upper()},",
            f"    capability: {capability},",
            "    values: [",
        ]
        for value in setting.values:
            span = "null" if value.choices else f"[{value.range['min'] / value.per:.12g}, {value.range['max'] / value.per:.12g}]"
            lines += [
                f"      {{ field: '{value.field.name}', info: '{value.info}', title: {text_of(value.title)}, per: {value.per}, whole: {'true' if value.whole else 'false'}, "
                f"span: {span}, choices: {value.choices or 'null'}, words: {value.words or 'null'}, unlessGiven: {'null' if value.default is None else value.default} }},"
            ]
        lines += ["    ],", "  },"]
    return [*lines, "] as const;"]
