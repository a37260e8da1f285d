"""Count of the single changes of the code that a test notices."""
