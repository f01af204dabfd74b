# A header as Doxygen is to read it: its comments are plain text with `code` in it. The first paragraph of a /// block is a
# description; what follows, in columns and with formulas, stays as it was laid out. Comments behind members belong to these,
# one on the outermost namespace to the file.
function plain(text) {
  gsub(/[\\@<>&#%$]/, "\\\\&", text)
  while (match(text, /`[^`]+`/)) {
    text = substr(text, 1, RSTART - 1) "<code>" substr(text, RSTART + 1, RLENGTH - 2) "</code>" substr(text, RSTART + RLENGTH)
  }
  return text
}
/^ *\/\/\// {
  text = $0
  sub(/^ *\/\/\/ ?/, "", text)
  if (!as_laid_out && (text == "" || text ~ /^  / || text ~ /^[a-zA-Z_, ]+   /)) {
    block = block "///\n/// @verbatim\n"
    as_laid_out = 1
  }
  if (text != "" || as_laid_out) block = block "/// " (as_laid_out ? text : plain(text)) "\n"
  next
}
block != "" {
  if (/^namespace touchfield /) print "/// @file"
  printf "%s%s", block, as_laid_out ? "/// @endverbatim\n" : ""
  as_laid_out = 0
  block = ""
}
/[;,}] +\/\/ / && !/^ *(\/\/|} *\/\/ namespace)/ || behind && /^ +\/\/ / {
  at = index($0, "// ")
  print substr($0, 1, at - 1) "///< " plain(substr($0, at + 3))
  behind = 1
  next
}
{
  behind = 0
  print
}
