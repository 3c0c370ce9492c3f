"""Validates an exported DAVE-ML file against the DTD of the standard.

    python3 tests/davefunc.py DAVEfunc.dtd flight_updated.dml

DAVEfunc.dtd is the one of daveml.org (DAVEfunc 2.0). It includes the DTD of MathML 2 from w3.org; the few of its elements
that the export uses are declared here instead, so that no network is needed. Needs lxml; ends with 77 where it is missing.
"""

import io
import re
import sys

try:
    from lxml import etree
except ImportError:
    print("lxml is not installed: nothing was validated")
    sys.exit(77)

MATHML = """
<!ELEMENT math (apply)> <!ATTLIST math xmlns CDATA #FIXED 'http://www.w3.org/1998/Math/MathML'>
<!ELEMENT apply ((plus | times), (apply | ci)+)> <!ELEMENT plus EMPTY> <!ELEMENT times EMPTY> <!ELEMENT ci (#PCDATA)>
"""

text = open(sys.argv[1], encoding="utf-8").read()
text = re.sub(r"<!ENTITY % mathml2.*?%mathml2;", MATHML, text, flags=re.S)
text = re.sub(r"^<\?xml.*?\?>", "", text)
dtd = etree.DTD(io.StringIO(text))
document = etree.parse(sys.argv[2], etree.XMLParser(load_dtd=False, no_network=True))
if dtd.validate(document):
    print(f"{sys.argv[2]} is valid: {sum(1 for _ in document.iter())} elements")
else:
    print(dtd.error_log.filter_from_errors())
    sys.exit(1)
