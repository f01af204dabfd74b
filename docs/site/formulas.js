for (const span of document.querySelectorAll('.arithmatex')) {
  katex.render(span.textContent.slice(2, -2), span, {displayMode: span.tagName === 'DIV'});
}
