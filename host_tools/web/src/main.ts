import './line/line';
