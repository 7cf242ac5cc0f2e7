//! Setters of the configuration structs, which have room for more fields.

/// Defines a `const` setter for each field of a configuration.
macro_rules! setters {
    ($($setter:ident, $field:ident: $type:ty;)*) => {
        $(
            #[doc = concat!("Returns the settings with another `", stringify!($field), "`.")]
            #[must_use]
            pub const fn $setter(mut self, $field: $type) -> Self {
                self.$field = $field;
                self
            }
        )*
    };
}

pub(crate) use setters;
