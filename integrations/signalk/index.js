// Steerway as an autopilot provider of a Signal K server. It passes requests of the v2 autopilot API to the control port
// of `steerway live` on this computer, as lines of JSON, and reports the autopilot's state. No dependencies.
'use strict'

const fs = require('fs')
const net = require('net')

const DEVICE = 'steerway'
const RETRY = 1000 // ms
const ANSWER = 2000 // ms for the answer to a request
const STATES = [
  { name: 'standby', engaged: false },
  { name: 'alarm', engaged: false },
  { name: 'enabled', engaged: true }
]
const MODES = ['route', 'course', 'position']
const REQUEST_OF_MODE = { route: 'route', course: 'hold-course', position: 'hold-position' }
const NAME_OF_STATE = {
  idle: 'standby',
  ready: 'standby',
  running: 'enabled',
  degraded: 'enabled',
  stopped: 'alarm',
  finished: 'standby'
}

function unsupported(what) {
  return Promise.reject(Object.assign(new Error(`${what} is not supported by Steerway`), { statusCode: 501 }))
}

module.exports = function (app) {
  let settings = {}
  let socket = null
  let timer = null
  let isRunning = false
  let steerway = null // its last state
  let next = 1
  const waiting = new Map() // by request: resolve, reject, timer

  function connect() {
    let rest = ''
    let greeting
    try {
      greeting = JSON.stringify({ token: token() }) + '\n'
    } catch (error) {
      app.setPluginError(`token file ${settings.tokenFile} cannot be read: ${error.code || error.message}`)
      timer = setTimeout(connect, RETRY)
      return
    }
    const here = net.connect(settings.port, settings.host)
    here.setEncoding('utf8')
    here.on('connect', () => here.write(greeting))
    here.on('data', (piece) => {
      const lines = (rest + piece).split('\n')
      rest = lines.pop()
      lines.filter(Boolean).forEach(receive)
    })
    here.on('error', () => {}) // "close" follows
    here.on('close', () => {
      if (socket !== here) return // the plugin was stopped, and possibly started again
      socket = null
      steerway = null
      publish()
      waiting.forEach((_, id) => settle(id, new Error('Steerway does not answer')))
      if (isRunning) {
        app.setPluginError(`no connection to Steerway at ${settings.host}:${settings.port}`)
        timer = setTimeout(connect, RETRY)
      }
    })
    socket = here
  }

  function token() {
    return settings.tokenFile ? fs.readFileSync(settings.tokenFile, 'utf8').trim() : settings.token || ''
  }

  function receive(line) {
    let message
    try {
      message = JSON.parse(line)
    } catch (error) {
      return
    }
    if (message === null || typeof message !== 'object') return
    if (message.state) {
      if (!steerway) app.setPluginStatus('connected to Steerway')
      steerway = message.state
      publish()
    } else if (message.id !== undefined) {
      settle(message.id, message.error && new Error(message.error))
    } else if (message.error) {
      app.setPluginError(message.error)
    }
  }

  function settle(id, error) {
    const request = waiting.get(id)
    if (!request) return
    waiting.delete(id)
    clearTimeout(request.timer)
    if (error) request.reject(Object.assign(error, { statusCode: 400 }))
    else request.resolve()
  }

  function ask(what, value) {
    if (!socket || !steerway) {
      return Promise.reject(Object.assign(new Error('Steerway does not answer'), { statusCode: 503 }))
    }
    return new Promise((resolve, reject) => {
      const id = next++
      const late = setTimeout(() => settle(id, new Error('Steerway does not answer')), ANSWER)
      waiting.set(id, { resolve, reject, timer: late })
      socket.write(JSON.stringify({ id, do: what, value }) + '\n')
    })
  }

  function data() {
    const engaged = Boolean(steerway && steerway.engaged)
    return {
      options: { states: STATES, modes: MODES, actions: [] },
      state: steerway ? NAME_OF_STATE[steerway.state] || 'standby' : 'offline',
      mode: steerway ? steerway.mode : null,
      target: steerway ? steerway.target : null,
      engaged
    }
  }

  function publish() {
    const { state, mode, target, engaged } = data()
    app.autopilotUpdate(DEVICE, { state, mode, target, engaged })
  }

  const provider = {
    getData: async () => data(),
    getState: async () => data().state,
    setState: (state) => {
      if (state === 'enabled') return ask('start')
      return state === 'standby' ? ask('stop') : unsupported(`state ${state}`)
    },
    getMode: async () => data().mode,
    setMode: (mode) => (REQUEST_OF_MODE[mode] ? ask(REQUEST_OF_MODE[mode]) : unsupported(`mode ${mode}`)),
    getTarget: async () => data().target,
    setTarget: (target) => ask('hold-course', target),
    adjustTarget: (by) => ask('adjust', by),
    engage: () => ask('start'),
    disengage: () => ask('stop'),
    tack: () => unsupported('tacking'),
    gybe: () => unsupported('gybing'),
    dodge: (by) => ask('dodge', by),
    courseCurrentPoint: () => ask('route'),
    courseNextPoint: () => unsupported('skipping to the next point')
  }

  return {
    id: 'signalk-steerway',
    name: 'Steerway autopilot',
    description: 'Engage, disengage, set and adjust the target of Steerway through the v2 autopilot API',
    schema: {
      type: 'object',
      properties: {
        host: { type: 'string', title: 'Host of the control port', default: '127.0.0.1' },
        port: { type: 'number', title: 'Control port', default: 10120 },
        tokenFile: { type: 'string', title: 'File with the token of the control port' },
        token: { type: 'string', title: 'Token, if there is no file' }
      }
    },
    start: (options) => {
      settings = { host: '127.0.0.1', port: 10120, ...options }
      isRunning = true
      app.registerAutopilotProvider(provider, [DEVICE])
      connect()
    },
    stop: () => {
      isRunning = false
      clearTimeout(timer)
      if (socket) socket.destroy()
      socket = null
      steerway = null
      waiting.forEach((_, id) => settle(id, new Error('Steerway does not answer')))
    }
  }
}
