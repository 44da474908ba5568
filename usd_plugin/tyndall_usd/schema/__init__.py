"""The codeless schema ``TyndallRenderSettingsAPI``: ``generate.py`` writes its files from ``table.py``."""
