"""The shipped networks on held-out renders as real cameras take them, and on photographs."""
