"""The documentation site: generated pages, films of the gallery, notebook and checks.

``mkdocs.yml`` names ``hooks.py``, through which MkDocs gets the generated pages.
"""
