"""The application: command line, case files, workflows, reports and pages."""
