"""Pictures and films of meshes, drawn without a screen."""
