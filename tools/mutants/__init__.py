"""How many single changes of the code a test notices."""
