"""Drafts of campaign manifests from files of test programs."""
