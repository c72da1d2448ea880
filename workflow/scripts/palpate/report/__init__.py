"""What people get to see: tables, figures and pages."""
