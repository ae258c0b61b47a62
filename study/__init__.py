"""Case files, command line, run folders, figures and reports."""
