"""Pictures: mode shapes drawn without a screen."""
