"""The command ``awarenav watch``: one crossing, shown in the browser while it runs."""
