"""What line.py writes into PROTOCOL.md: its tables, and its numbers."""

import re

WHEN_TEXTS = {"flags": "", "capabilities": "capability ", "stored": "stored "}


def protocol_parts(line):
    """name -> lines, for between its marks."""

    def table(fields, always=True):
        conditions = any(field.when for field in fields)
        rows = ["| type | field | what |" + (" there if |" if conditions else ""), "|---|---|---|" + ("---|" if conditions else "")]
        for field in fields:
            when = f" {WHEN_TEXTS[field.when[0]]}{field.when[1]} |" if field.when else " always |"
            rows.append(f"| {field.type_text} | {field.names_text} | {field.text} |" + (when if conditions else ""))
        return rows

    parts = {name: table(body.fields) for name, body in (*line.packets.items(), *line.structs.items())}
    parts["flags"] = ["| bit | name | meaning |", "|---|---|---|"] + [
        f"| {flag['bit']} | {flag['name']} | {flag['text']}{'; ' + flag['more'] if 'more' in flag else ''} |" for flag in line.flags
    ]
    for name in ("streams", "capabilities", "stored"):
        parts[name] = ["| bit | name | meaning |", "|---|---|---|"] + [
            f"| {each['bit']} | {each['word']} | {each['text']} |" for each in getattr(line, name)
        ]
    parts["results"] = ["| number | meaning |", "|---|---|"] + [f"| {each['number']} | {each['text']} |" for each in line.results]

    def range_text(field):
        if not field.range:
            return ""
        each = line.ranges[field.range]
        if "words" in each:
            return f" ({', '.join(f'{number} {word}' for number, word in zip(each['choices'], each['words'], strict=True))})"
        return (
            f" ({', '.join(map(str, each['choices']))})"
            if "choices" in each
            else f" ({each['min']:.12g} to {each['max']:.12g} {each['unit']})"
        )

    parts["commands"] = ["| type | command | body | known with | what it does |", "|---|---|---|---|---|"]
    for body in sorted(line.commands.values(), key=lambda body: body.type):
        fields = ", ".join(
            f"{field.type_text} {field.names_text}{range_text(field)}{': ' + field.text if field.text and not field.range else ''}"
            for field in body.fields
        )
        known = next((each["word"] for each in line.capabilities if each["name"] == body.capability), "always")
        parts["commands"].append(f"| 0x{body.type:02X} | {body.word} | {fields or '-'} | {known} | {body.text} |")
    return parts


def protocol_md(line, text):
    """The page with its tables replaced. Each follows a mark "<!-- line.toml: NAME -->" and ends with an empty line."""
    for name, rows in protocol_parts(line).items():
        mark = f"<!-- line.toml: {name} -->\n"
        if text.count(mark) != 1:
            raise SystemExit(f"line.py: PROTOCOL.md has {text.count(mark)} marks of {name}, it needs one")
        before, _, after = text.partition(mark)
        text = before + mark + "\n".join(rows) + "\n\n" + after.partition("\n\n")[2]
    numbers = {
        r"# Wire protocol, version {}\n": line.version,
        r"\| 0 \| u8 \| version, {} \|": line.version,
        r"longer than {} bytes is damage": line.longest_frame(),
    }
    for form, number in numbers.items():
        before, after = form.split("{}")
        text, count = re.subn(rf"({before})\d+({after})", rf"\g<1>{number}\g<2>", text)
        if count != 1:
            raise SystemExit(f'line.py: PROTOCOL.md has {count} times "{form}", it needs one')
    return text
