"""The surface: template, rigid alignment, the elastic tracker."""
