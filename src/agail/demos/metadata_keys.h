// The names under which Minari (and we) keep what is known of a dataset.
#pragma once

namespace agail {

inline constexpr const char* kPatternKey = "missing_pattern";  // ours: how actions were removed
inline constexpr const char* kRatioKey = "missing_ratio";  // ours: eta, for readers; never trusted

// Lists of texts; in a single file as JSON.
inline constexpr const char* kListKeys[] = {"author", "author_email", "requirements",
                                            "combined_datasets"};

}  // namespace agail
