"""The shipped scenarios listed, explained, drawn and checked: ``awarenav scenario``."""
