// YAML of policies: block and flow mappings and sequences, comments, and plain or quoted scalars.
// Anything else is refused with its line.

const MOST_CHARACTERS = 1 << 20;
const MOST_DEEP = 64;

class YamlError extends Error {}

/** The value of a YAML text. */
function parseYaml(text) {
  if (text.length > MOST_CHARACTERS) throw new YamlError("too large: at most 1 MiB is read");
  const reader = new YamlReader(text);
  const value = reader.block(-1, 0);
  if (reader.line) reader.fail("a key or an item does not belong here: check the indentation");
  return value;
}

class YamlReader {
  constructor(text) {
    this.lines = this.cleaned(text);
    this.next = 0;
  }

  get line() { return this.lines[this.next]; }

  fail(message, number = this.line?.number) {
    throw new YamlError(`not valid YAML${number ? `, line ${number}` : ""}: ${message}`);
  }

  /** The lines with content: number, indent and text without comments; open brackets joined. */
  cleaned(text) {
    const lines = [];
    let open = null;
    text.replace(/^\uFEFF/, "").split(/\r\n|\r|\n/).forEach((raw, index) => {
      const content = withoutComment(raw).trimEnd();
      const number = index + 1;
      if (content.trim() === "") return;
      if (open) {
        open.text += ` ${content.trim()}`;
        open = bracketDepth(open.text) > 0 ? open : null;
        return;
      }
      if (/^(---|\.\.\.)(\s|$)/.test(content)) {
        if (lines.length || content.length > 3) this.fail("only one document is read", number);
        return;
      }
      if (/^\s*\t/.test(raw)) this.fail("a tab cannot indent; use spaces", number);
      const line = { number, indent: content.search(/\S/), text: content.trim() };
      lines.push(line);
      if (bracketDepth(line.text) > 0) open = line;
    });
    if (open) this.fail("a bracket is not closed", open.number);
    return lines;
  }

  /** The value of the lines that are indented by more than `parent`. */
  block(parent, depth) {
    if (depth > MOST_DEEP) this.fail("nested too deeply");
    if (!this.line || this.line.indent <= parent) return null;
    const { indent } = this.line;
    if (isItem(this.line.text)) return this.sequence(indent, depth);
    if (keyOf(this.line.text)) return this.mapping(indent, depth);
    const value = this.scalar(this.line.text);
    this.next += 1;
    return value;
  }

  sequence(indent, depth) {
    const items = [];
    while (this.line && this.line.indent === indent && isItem(this.line.text)) {
      const { text } = this.line, rest = text.slice(1).trimStart();
      if (rest === "") {
        this.next += 1;
        items.push(this.block(indent, depth + 1));
      } else if (isItem(rest) || keyOf(rest)) {
        // The rest of the line begins a block of its own, as deep as it stands.
        this.line.indent = indent + text.length - rest.length;
        this.line.text = rest;
        items.push(this.block(indent, depth + 1));
      } else {
        items.push(this.scalar(rest));
        this.next += 1;
      }
    }
    return items;
  }

  mapping(indent, depth) {
    const found = {};
    while (this.line && this.line.indent === indent) {
      const entry = keyOf(this.line.text);
      if (!entry) this.fail("a key followed by a colon is expected");
      const key = String(this.scalar(entry.key));
      if (Object.hasOwn(found, key)) this.fail(`the key '${key}' occurs twice`);
      let value;
      if (entry.rest !== "") {
        value = this.scalar(entry.rest);
        this.next += 1;
      } else {
        this.next += 1;
        // A list may stand as deep as its key.
        const level = this.line?.indent === indent && isItem(this.line.text) ? indent - 1 : indent;
        value = this.block(level, depth + 1);
      }
      Object.defineProperty(found, key, {
        value, enumerable: true, writable: true, configurable: true,
      });
    }
    return found;
  }

  /** The value of a text on one line: a scalar, or a collection in brackets. */
  scalar(text) {
    const flow = new FlowReader(text, (message) => this.fail(message));
    return flow.whole();
  }
}

class FlowReader {
  constructor(text, fail) {
    this.text = text;
    this.at = 0;
    this.fail = fail;
  }

  whole() {
    const value = this.value("", 0);
    this.space();
    if (this.at < this.text.length) this.fail(`'${this.text.slice(this.at)}' is not expected`);
    return value;
  }

  space() { while (this.text[this.at] === " ") this.at += 1; }

  value(ends, depth) {
    if (depth > MOST_DEEP) this.fail("nested too deeply");
    this.space();
    const first = this.text[this.at] ?? "";
    if (first === "[") return this.list(depth);
    if (first === "{") return this.map(depth);
    if (first === '"' || first === "'") return this.quoted(first);
    if ("&*!|>%@`".includes(first) && first !== "")
      this.fail(`anchors, aliases, tags and block texts are not read ('${first}')`);
    let end = this.at;
    while (end < this.text.length && !ends.includes(this.text[end])) {
      if (ends.includes(":") && this.text[end] === ":") break;
      end += 1;
    }
    const plain = this.text.slice(this.at, end).trim();
    this.at = end;
    if (ends === "" && /:(\s|$)/.test(plain)) this.fail("two keys stand on one line");
    return plainScalar(plain, this.fail);
  }

  list(depth) {
    const items = [];
    this.at += 1;
    for (this.space(); this.text[this.at] !== "]"; this.space()) {
      items.push(this.value(",]}", depth + 1));
      this.separator("]");
    }
    this.at += 1;
    return items;
  }

  map(depth) {
    const found = {};
    this.at += 1;
    for (this.space(); this.text[this.at] !== "}"; this.space()) {
      const key = String(this.value(":,]}", depth + 1));
      this.space();
      let value = null;
      if (this.text[this.at] === ":") {
        this.at += 1;
        value = this.value(",]}", depth + 1);
      }
      if (Object.hasOwn(found, key)) this.fail(`the key '${key}' occurs twice`);
      Object.defineProperty(found, key, {
        value, enumerable: true, writable: true, configurable: true,
      });
      this.separator("}");
    }
    this.at += 1;
    return found;
  }

  separator(end) {
    this.space();
    if (this.text[this.at] === ",") this.at += 1;
    else if (this.text[this.at] !== end) this.fail(`'${end}' or ',' is expected`);
  }

  quoted(mark) {
    let value = "";
    for (this.at += 1; this.at < this.text.length; this.at += 1) {
      const letter = this.text[this.at];
      if (letter === mark) {
        if (mark !== "'" || this.text[this.at + 1] !== "'") {
          this.at += 1;
          return value;
        }
        this.at += 1;
      } else if (letter === "\\" && mark === '"') this.fail("escapes in quotes are not read");
      value += letter;
    }
    return this.fail("a quote is not closed");
  }
}

/** The value of a plain scalar by the rules of YAML 1.1; 5e-2 is a number as well. */
function plainScalar(text, fail) {
  if (/^(~|null|Null|NULL|)$/.test(text)) return null;
  if (/^(yes|Yes|YES|true|True|TRUE|on|On|ON)$/.test(text)) return true;
  if (/^(no|No|NO|false|False|FALSE|off|Off|OFF)$/.test(text)) return false;
  if (/^[-+]?\.(inf|Inf|INF|nan|NaN|NAN)$/.test(text))
    return fail(`${text} is not a finite number`);
  if (/^[-+]?0[0-9xXbBoO_]|^[-+]?\d+(:\d+)+|^[-+]?[\d.]*_/.test(text))
    return fail(`'${text}' is not a plain decimal number`);
  if (/^[-+]?(0|[1-9]\d*)$/.test(text)) return Number(text);
  if (/^[-+]?(\d+\.\d*|\.\d+|(\d+\.?\d*|\.\d+)[eE][-+]?\d+)$/.test(text)) return Number(text);
  return text;
}

const isItem = (text) => text === "-" || text.startsWith("- ");

/** The key at the start of a line and the text after its colon; null for no key. */
function keyOf(text) {
  if (/^[[{]/.test(text)) return null;
  const found = /^("[^"\\]*"|'(?:[^']|'')*'|[^"'][^]*?)\s*:(?:\s+|$)/.exec(text);
  return found && { key: found[1], rest: text.slice(found[0].length).trim() };
}

/** Walks over a line outside of quotes. */
function outsideQuotes(line, visit) {
  let quote = "";
  for (let at = 0; at < line.length; at += 1) {
    const letter = line[at];
    if (quote) quote = letter === quote ? "" : quote;
    else if (/["']/.test(letter) && /^$|[\s[{,:]/.test(line[at - 1] ?? "")) quote = letter;
    else if (visit(letter, at) === false) return;
  }
}

function withoutComment(line) {
  let end = line.length;
  outsideQuotes(line, (letter, at) => {
    if (letter !== "#" || (at > 0 && !/\s/.test(line[at - 1]))) return true;
    end = at;
    return false;
  });
  return line.slice(0, end);
}

function bracketDepth(line) {
  let depth = 0;
  outsideQuotes(line, (letter) => { depth += "[{".includes(letter) - "]}".includes(letter); });
  return depth;
}

/** A policy as the text of a YAML file that AwarenessPolicy.from_yaml reads. */
function policyYaml(policy) {
  const lines = [];
  const write = (model, indent) => {
    for (const [key, value] of Object.entries(model)) {
      if (isMapping(value)) {
        lines.push(`${indent}${key}:`);
        write(value, `${indent}  `);
      } else lines.push(`${indent}${key}: ${yamlScalar(value)}`);
    }
  };
  write(policy, "");
  return `${lines.join("\n")}\n`;
}

/** A scalar, or a list in brackets, that YAML 1.1 reads as the same value. */
function yamlScalar(value) {
  if (Array.isArray(value)) return `[${value.map(yamlScalar).join(", ")}]`;
  if (typeof value !== "number") return String(value);
  // YAML 1.1 reads a float only with a point, and an exponent only with its sign.
  const [digits, exponent] = String(value).split("e");
  const mantissa = digits.includes(".") ? digits : `${digits}.0`;
  if (!exponent) return mantissa;
  return `${mantissa}e${/^[-+]/.test(exponent) ? "" : "+"}${exponent}`;
}
